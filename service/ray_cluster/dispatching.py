"""Offers jobs to Ray, one task each, and takes back those whose task was lost.

Ray only executes: it may run a task twice, and a task may go on after Ray has called it lost.  So
the row decides.  An offer has an owner's name of its own, under which its task claims the row, and
under which the row is taken back; whoever does not hold the row any more is not heard.
"""

from __future__ import annotations

import logging
import secrets
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from service.engines.failures import process_died
from service.engines.signals import Bell
from service.errors import ServiceError
from service.jobs.job import Failure
from service.jobs.turns import Shares
from service.ray_cluster.foretelling import foretold_memory
from service.ray_cluster.nodes import Nodes
from service.ray_cluster.task import do_job
from service.settings import Settings
from service.storage.offer_store import SqlOffers
from simplifier import __version__

_AHEAD = 4
"""Every so many processors have one offer beside those that they are at, so that the next job is
there when one ends; all have two at least."""

_FIRST_PAUSE, _LONGEST_PAUSE = 0.5, 30.0
"""Seconds for which a job is not offered again whose task has ended without its end."""

_THREADS = 1  # of a job, each on a processor that is its own

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Offer:
    job_id: str
    owner: str
    memory: int
    answer: Any  # Ray's reference to None


class Dispatcher:
    """Keeps a bounded number of jobs offered.  For one thread; a task that ends rings ``bell``."""

    def __init__(
        self, ray: Any, nodes: Nodes, offers: SqlOffers, settings: Settings, bell: Bell
    ) -> None:
        self._ray, self._nodes, self._jobs, self._settings = ray, nodes, offers, settings
        self._bell = bell
        self._task = ray.remote(do_job)
        self._name = f"ray-{secrets.token_hex(6)}"
        self._count = 0
        self._open: dict[str, _Offer] = {}
        self._ended: deque[tuple[_Offer, Exception | None]] = deque()
        self._lost: dict[str, tuple[_Offer, Failure | None]] = {}
        self._pauses: dict[str, tuple[int, float]] = {}  # tries, and until when

    @property
    def under_way(self) -> int:
        """Offers whose tasks have not ended."""
        return len(self._open)

    def step(self, *, offering: bool) -> None:
        """See to what has ended, and offer what there is room for, if it is to offer.

        Raises what the stores raise; nothing is forgotten then.
        """
        self._nodes.look()
        self._settle()
        self._take_back()
        if offering:
            self._withdraw_what_fits_nowhere()
            self._offer()

    def give_back(self) -> None:
        """Queue all jobs again, at no cost to them, after Ray has ended their tasks."""
        self._settle()
        for offer in self._open.values():
            self._lost[offer.owner] = offer, None
        self._open.clear()
        self._take_back()

    def _offer(self) -> None:
        places = self._nodes.processors
        most = places + max(2, places // _AHEAD)
        if len(self._open) >= most:
            return
        shares = Shares(max(1, places), running=self._settings.tenant_running)
        now = time.monotonic()
        self._pauses = {one: pause for one, pause in self._pauses.items() if pause[1] > now - 60.0}
        for job, inputs in self._jobs.next_in_turn(shares, most):
            paused = job.id in self._pauses and self._pauses[job.id][1] > now
            if paused or job.id in self._open:
                continue
            if len(self._open) >= most:
                break
            # More than any node has would wait for ever; the limit of the process holds all the
            # same.
            memory = min(foretold_memory(job, inputs, self._settings), self._nodes.largest_memory)
            self._give(job.id, memory, max(1, places))

    def _give(self, job_id: str, memory: int, places: int) -> None:
        self._count += 1
        owner = f"{self._name}-{self._count}"
        task = self._task.options(
            name="occluder job", num_cpus=_THREADS, num_gpus=0, memory=memory, max_retries=0,
            **self._nodes.placement(),
        )  # fmt: skip
        answer = task.remote(job_id, owner, __version__, places, _THREADS)
        offer = self._open[job_id] = _Offer(job_id, owner, memory, answer)
        answer.future().add_done_callback(self._on_end(offer))

    def _on_end(self, offer: _Offer) -> Callable[[Any], None]:
        def ended(future: Any) -> None:  # in a thread of Ray's
            self._ended.append((offer, future.exception()))
            self._bell.ring()

        return ended

    def _settle(self) -> None:
        """Tasks that have ended: with what went wrong, if anything did."""
        while self._ended:
            offer, error = self._ended.popleft()
            if self._open.get(offer.job_id) is not offer:
                continue  # it was withdrawn
            del self._open[offer.job_id]
            # Where the row has ended, nobody offers it again, and the pause means nothing.
            self._pause(offer.job_id)
            if error is not None:
                what = _in_words(error)
                _log.error("the task of job %s is lost: %s", offer.job_id, what)
                self._lost[offer.owner] = offer, process_died(f"is gone with its task: {what}")

    def _take_back(self) -> None:
        for owner, (offer, failure) in list(self._lost.items()):
            back = self._jobs.take_back(offer.job_id, owner, failure)
            if back is not None:
                _log.info("job %s was taken back and is %s", back.id, back.state)
                self._pauses.pop(back.id, None)
            del self._lost[owner]

    def _withdraw_what_fits_nowhere(self) -> None:
        """Offers that wait for a node that is gone would wait for ever."""
        largest = self._nodes.largest_memory
        for offer in list(self._open.values()):
            if offer.memory > largest > 0:
                self._ray.cancel(offer.answer, force=True)
                del self._open[offer.job_id]
                self._lost[offer.owner] = offer, None

    def _pause(self, job_id: str) -> None:
        tries = self._pauses.get(job_id, (0, 0.0))[0]
        seconds = min(_FIRST_PAUSE * 2.0**tries, _LONGEST_PAUSE)
        self._pauses[job_id] = tries + 1, time.monotonic() + seconds


def _in_words(error: Exception) -> str:
    cause = getattr(error, "cause", None) or error
    if isinstance(cause, ServiceError):
        return cause.detail
    first = str(cause).strip().partition("\n")[0]
    return f"{type(cause).__name__} ({first[:200]})" if first else type(cause).__name__
