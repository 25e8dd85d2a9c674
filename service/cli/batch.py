"""Many meshes, several at a time, with Ctrl-C cancelling what was begun.

Each one under way has a line on standard error, and leaves one behind when it has ended.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from service.cli.mesh_submission import MeshOutcome, MeshSubmission, submit_one
from service.client import Client, ClientError, Keep, Priority
from simplifier.cli.plugin import (
    INTERRUPTED,
    interrupts,
    percent,
    percent_at_most,
    print_line,
    print_text,
)

_GLANCE = 0.1  # seconds between looks at whether to stop
_PATIENCE = 3600.0  # seconds for which a full queue is waited for

_LONGEST_NAME = 32


def submit_all(
    submissions: Sequence[MeshSubmission],
    server: str,
    key: str | None,
    at_once: int,
    keep: Keep | None = None,
) -> int:
    """Print what came of each; the exit status.

    ``keep``  which files of their results are stored; None leaves it to the service.
    """
    with interrupts() as listening:
        with listening.deferred() as stop, submission_bars() as bars:
            # Who sends one waits for it; who sends many lets the others of the tenant go first.
            priority = Priority.BULK if len(submissions) > 1 else Priority.INTERACTIVE
            failed = _Batch(server, key, priority, keep, stop, bars).run(submissions, at_once)
        if listening.heard:
            print_line("error: interrupted; what was under way is cancelled, the rest is kept")
            return INTERRUPTED
    if failed:
        print_line(f"error: {failed} of {len(submissions)} failed; the lines above say why")
    return int(failed > 0)


class _Batch:
    """The jobs begun here, until they have ended."""

    def __init__(
        self,
        server: str,
        key: str | None,
        priority: Priority,
        keep: Keep | None,
        stop: threading.Event,
        bars: SubmissionBars,
    ) -> None:
        self._client = Client(
            server, key=key, patience=_PATIENCE, priority=priority, keep=keep, stop=stop
        )
        self._canceller = Client(server, key=key, patience=0.0)
        self._stop, self._bars = stop, bars
        self._lock = threading.Lock()
        self._begun: set[str] = set()

    def run(self, submissions: Sequence[MeshSubmission], at_once: int) -> int:
        """How many failed."""
        failed, stopping = 0, False
        with self._client, self._canceller, ThreadPoolExecutor(at_once) as pool:
            waiting: set[Future[MeshOutcome]] = {
                pool.submit(self._submit, one) for one in submissions
            }
            while waiting:
                done, waiting = wait(waiting, _GLANCE, FIRST_COMPLETED)
                for outcome in (one.result() for one in done if not one.cancelled()):
                    self._end(outcome)
                    failed += bool(outcome.fault)
                if self._stop.is_set() and not stopping:
                    stopping = True
                    pool.shutdown(wait=False, cancel_futures=True)
                    self._cancel_all()
        return failed

    def _submit(self, submission: MeshSubmission) -> MeshOutcome:
        name = str(submission.mesh)
        self._bars.begin(name)
        return submit_one(
            self._client,
            submission,
            lambda now, share, measure: self._bars.tell(name, now, share, measure),
            self._note,
        )

    def _end(self, outcome: MeshOutcome) -> None:
        if outcome.job is not None:
            with self._lock:
                self._begun.discard(outcome.job.id)
        self._bars.end(str(outcome.submission.mesh))
        self._bars.print(_line(outcome), failed=bool(outcome.fault))

    def _note(self, job_id: str) -> None:
        with self._lock:
            self._begun.add(job_id)
        if self._stop.is_set():  # the others may have been cancelled by now
            self._cancel(job_id)

    def _cancel_all(self) -> None:
        with self._lock:
            begun = tuple(self._begun)
        for job_id in begun:
            self._cancel(job_id)

    def _cancel(self, job_id: str) -> None:
        with suppress(ClientError):  # a server that is gone has nothing to cancel
            self._canceller.cancel(job_id)


def _line(outcome: MeshOutcome) -> str:
    mesh = outcome.submission.mesh
    if outcome.fault or outcome.job is None or outcome.job.summary is None:
        return f"error: {mesh}: {outcome.fault}"
    told = outcome.job.summary
    figures = [f"{told.input_triangles:,} -> {told.triangles:,} triangles"]
    if told.precision is not None and told.recall is not None:
        figures += [f"precision {percent(told.precision, 2)}", f"recall {percent(told.recall, 2)}"]
    if told.overhang is not None:
        figures.append(f"overhang {percent_at_most(told.overhang)}")
    if told.verdict is not None:
        figures.insert(0, told.verdict)
    return f"{mesh}: {', '.join(figures)}; {', '.join(map(str, outcome.files))}"


class SubmissionBars:
    """The lines, by the name of the mesh; nothing where standard error is no terminal.

    Lines may begin and change in any thread; they end, and text is printed, in one.
    """

    def __init__(self, bars: Progress | None) -> None:
        self._bars = bars
        self._tasks: dict[str, TaskID] = {}

    def begin(self, name: str) -> None:
        if self._bars is not None:
            shown = name if len(name) <= _LONGEST_NAME else f"...{name[3 - _LONGEST_NAME :]}"
            self._tasks[name] = self._bars.add_task(escape(shown), total=1.0, now="", measure="")

    def tell(self, name: str, now: str, share: float, measure: float | None) -> None:
        if self._bars is not None:
            reached = "" if measure is None else f"measure {percent(measure)}"
            self._bars.update(self._tasks[name], completed=share, now=now, measure=reached)

    def end(self, name: str) -> None:
        if self._bars is not None:
            self._bars.remove_task(self._tasks.pop(name))

    def print(self, line: str, *, failed: bool) -> None:
        """Print a line that stays: on standard error for a failure, else on standard output."""
        if self._bars is not None:
            self._bars.stop()  # in one terminal the two would mix
        (print_line if failed else print_text)(line)
        if self._bars is not None:
            self._bars.start()


@contextmanager
def submission_bars() -> Iterator[SubmissionBars]:
    console = Console(stderr=True)
    if not console.is_terminal:
        yield SubmissionBars(None)
        return
    columns = (
        TextColumn("{task.description:<32}"),
        BarColumn(),
        TextColumn("{task.fields[now]:<12} {task.fields[measure]}", markup=False),
        TimeElapsedColumn(),
    )

    with Progress(*columns, console=console, transient=True, redirect_stdout=False) as bars:
        yield SubmissionBars(bars)
