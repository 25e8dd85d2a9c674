"""A run's jobs as Ray tasks, on all nodes that run this release.

What is shared is put into Ray's object store once; each node that does a job fetches it once, and
all of the node's processes map it.  A task takes one processor and what memory its job needs, and
answers with bytes.  What comes of a lost worker or node is decided here and not by Ray, which would
try again without end, or give up.

Ray itself pickles: a driver's tasks and arrays are unpickled by nodes, which run the driver's code
in any case, and of answers Ray unpickles bytes alone, though a node that was taken over could send
others.  So a cluster is one zone of trust, and has a token.
"""

from __future__ import annotations

import os
import secrets
import time
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from service.errors import SettingsError
from service.ray_cluster.joining import joined
from service.ray_cluster.nodes import Nodes
from simplifier import BackendUnavailableError, OptionError, __version__
from simplifier.pools import (
    ATTEMPTS,
    DIED,
    Answer,
    Array,
    Arrived,
    Attempt,
    Cancel,
    JobOutcome,
    PoolJob,
    Shared,
    Work,
    answer_of,
    start_work,
)
from simplifier.pools import joined as whole

_GLANCE = 0.05  # seconds between looks at whether to stop
_LOOK = 1.0  # seconds between looks at which nodes there are
_FIRST = 20.0  # seconds that the nodes have to answer before the first job
_PATIENCE = 120.0  # seconds without any processor; a cluster that grows by itself needs some
_WAITING = 2  # tasks a processor: one runs, and the next is there when it ends
_LEAST = 16  # tasks, so that a cluster that grows by itself hears of them
_PROCESS = 256 << 20  # bytes of a worker beside its job
_MEMORY_STEP = 512 << 20  # bytes: Ray queues tasks of each amount by themselves


@contextmanager
def ray_pool() -> Iterator[RayPool]:
    """The cluster that Ray's own variables name, ``RAY_ADDRESS`` and its token.

    Raises :class:`~simplifier.OptionError` where it cannot be joined, or no node of it is fit.
    """
    try:
        with joined() as ray:
            nodes = Nodes(ray)
            nodes.look(_FIRST)
            if not nodes.processors and nodes.unfit:
                raise SettingsError(
                    f"no node may get work: {'; '.join(sorted(set(nodes.unfit.values())))}"
                )
            yield RayPool(ray, nodes)
    except SettingsError as error:
        raise OptionError(str(error), where="pool") from None


class RayPool:
    """A cluster that this process is a driver of.  For one thread."""

    def __init__(self, ray: Any, nodes: Nodes) -> None:
        self._ray, self._nodes = ray, nodes
        self._task = ray.remote(do_job)

    @property
    def where(self) -> str:
        nodes, processors = self._nodes.count, self._nodes.processors
        return (
            f"on {nodes} node{'s' if nodes != 1 else ''} with {processors}"
            f" processor{'s' if processors != 1 else ''}, by ray"
        )

    def run_jobs(
        self, work: str, shared: Shared, jobs: Sequence[PoolJob], cancel: Cancel | None = None
    ) -> Generator[JobOutcome, None, None]:
        """As :class:`~simplifier.pools.Pool` says.

        A job that needs more memory than any node has is not done.  Raises
        :class:`~simplifier.BackendUnavailableError` where no node is left for minutes, and where
        the object store cannot hold what is shared.
        """
        if not jobs:
            return
        run = _Run(self._ray, self._nodes, self._task, work, self._put(shared), jobs)
        try:
            while run.at_work:
                if cancel is not None and cancel.is_set():
                    return
                run.look()
                yield from run.give()
                yield from run.take()
        finally:
            run.end()

    def _put(self, shared: Shared) -> Any:
        arrays = {name: whole(pieces) for name, pieces in shared.arrays.items()}
        try:
            return self._ray.put((secrets.token_hex(8), shared.settings, arrays))
        except self._ray.exceptions.ObjectStoreFullError:
            raise BackendUnavailableError(
                f"Ray's object store has no room for {shared.nbytes / 2**30:.1f} GiB",
                remedy="start each node with a larger 'ray start --object-store-memory=BYTES'",
            ) from None


class _Run:
    """The tasks under way, and the attempts that wait for one."""

    def __init__(
        self, ray: Any, nodes: Nodes, task: Any, work: str, shared: Any, jobs: Sequence[PoolJob]
    ) -> None:
        self._ray, self._nodes, self._task, self._work = ray, nodes, task, work
        self._shared, self._jobs = shared, jobs
        self._waiting = deque(Attempt(job) for job in range(len(jobs)))
        self._under_way: dict[Any, Attempt] = {}
        self._looked = self._served = time.monotonic()

    @property
    def at_work(self) -> bool:
        return bool(self._waiting or self._under_way)

    def look(self) -> None:
        """At which nodes there are, now and then."""
        now = time.monotonic()
        if now - self._looked < _LOOK:
            return
        self._nodes.look()
        self._looked = now
        if self._nodes.processors:
            self._served = now
        elif now - self._served > _PATIENCE:
            raise BackendUnavailableError(
                f"no node of the Ray cluster has had a processor for this for {_PATIENCE:.0f} s",
                remedy="start nodes by 'ray start', and give the same command again: it goes on",
            )

    def give(self) -> Iterator[JobOutcome]:
        """Hand out as many tasks as are worth it; what comes of jobs that no node can do."""
        most = max(_LEAST, _WAITING * self._nodes.processors)
        while self._waiting and len(self._under_way) < most:
            attempt = self._waiting.popleft()
            job = self._jobs[attempt.job]
            memory = self._memory(job.need)
            if memory is None:
                need, largest = (job.need / 2**30, self._nodes.largest_memory / 2**30)
                told = f"it needs {need:.1f} GiB of memory, and no node has more than {largest:.1f}"
                yield JobOutcome(attempt.job, Answer(failure=told))
                continue
            placed = self._task.options(
                num_cpus=1, memory=memory, max_retries=0, **self._nodes.placement()
            )
            task = placed.remote(__version__, self._work, self._shared, job.data)
            self._under_way[task] = attempt

    def _memory(self, need: int) -> int | None:
        """Bytes that a task is to have for itself; None where no node has so many."""
        largest = self._nodes.largest_memory
        if need + _PROCESS > largest > 0:
            return None
        steps = -(-(need + _PROCESS) // _MEMORY_STEP)
        amount = _MEMORY_STEP * (1 << (steps - 1).bit_length())
        return min(amount, largest) if largest else amount

    def take(self) -> Iterator[JobOutcome]:
        """What came of tasks that are over, after a glance's time at most."""
        if not self._under_way:
            time.sleep(_GLANCE)
            return
        done, _ = self._ray.wait(list(self._under_way), num_returns=1, timeout=_GLANCE)
        if done:
            tasks = list(self._under_way)
            done, _ = self._ray.wait(tasks, num_returns=len(tasks), timeout=0)
        for task in done:
            attempt = self._under_way.pop(task)
            answer = self._answer(task, attempt)
            if answer is not None:
                yield JobOutcome(attempt.job, answer)

    def _answer(self, task: Any, attempt: Attempt) -> Answer | None:
        """None where the job waits for another attempt."""
        told = self._ray.exceptions
        try:
            answer = _read(self._ray.get(task))
        except told.RayTaskError as error:  # of what is around the work: it could not be loaded
            last = str(error).strip().splitlines()[-1:]
            why = f"a worker cannot do it ({' '.join(last)})"
        except told.OutOfMemoryError:
            why = "its node was out of memory, twice"
        except told.RayError:  # the worker, its node or its answer is lost
            why = DIED
        else:
            if answer is None:  # by a node of another release, which had not told yet
                self._waiting.appendleft(attempt)
            return answer
        if attempt.number < ATTEMPTS:
            self._waiting.append(Attempt(attempt.job, attempt.number + 1))
            return None
        return Answer(failure=why)

    def end(self) -> None:
        """Whatever runs is killed; what is shared goes with the last that refers to it."""
        for task in self._under_way:
            self._ray.cancel(task, force=True)
        self._under_way.clear()
        self._shared = None


_RESULT, _FAILURE, _UNFIT = b"+", b"-", b"?"  # what an answer begins with

_started: dict[str, Work] = {}


def do_job(
    release: str, work: str, shared: tuple[str, bytes, dict[str, Array]], job: bytes
) -> bytes:
    """The task.  A process keeps what it has started, for the jobs of the same run."""
    if release != __version__:
        return _UNFIT
    run, settings, arrays = shared
    if run not in _started:
        os.environ["OCCLUDER_THREADS"] = "1"  # a task has one processor
        _started.clear()
        _started[run] = start_work(work, Arrived(settings, arrays))
    answer = answer_of(_started[run], job)
    if answer.failure:
        return _FAILURE + answer.failure.encode(errors="replace")
    return _RESULT + bytes(answer.result)


def _read(answer: object) -> Answer | None:
    """None of a node that is not fit."""
    if not isinstance(answer, bytes):
        return Answer(failure="a worker answered with something else than bytes")
    kind, rest = answer[:1], answer[1:]
    if kind == _RESULT:
        return Answer(rest)
    return None if kind == _UNFIT else Answer(failure=rest.decode(errors="replace"))
