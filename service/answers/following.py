"""Following a job without holding a thread."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Self

from anyio import move_on_after
from anyio.to_thread import run_sync
from starlette.requests import Request
from starlette.responses import Response

from service.headers import wait_seconds, wants_result
from service.jobs.job import Job
from service.jobs.progress import JobProgress, ProgressBoard
from service.jobs.stores import JobStore

_SHORTEST_HOP = 1.0  # seconds that a request waits at least before it is sent on
_LOOK = 5.0  # seconds after which a job is looked at though nothing was heard


@contextmanager
def hearing(board: ProgressBoard, job_id: str) -> Iterator[asyncio.Event]:
    """An event that is set whenever the job's progress or state has changed."""
    loop = asyncio.get_running_loop()
    changed = asyncio.Event()

    def hear(_: str) -> None:
        # Raised where the loop has ended, and with it whoever waits.
        with suppress(RuntimeError):
            loop.call_soon_threadsafe(changed.set)

    stop = board.listen(job_id, hear)
    try:
        yield changed
    finally:
        stop()


async def look(jobs: JobStore, job: Job) -> Job:
    """The job as it is stored now.  Raises :class:`~service.errors.NotFoundError`."""
    return await run_sync(jobs.job, job.tenant, job.id)


async def news(
    jobs: JobStore, board: ProgressBoard, job: Job, quiet: float
) -> AsyncGenerator[Job | JobProgress | None, None]:
    """The job at once and whenever its state is another, and its progress between.

    None after ``quiet`` seconds without either.  Ends with the job that has ended.  While progress
    comes the state is taken as it was, so that it costs no look into the database.
    """
    with hearing(board, job.id) as changed:
        seen: Job | None = None
        told: JobProgress | None = None
        while True:
            changed.clear()
            progress = board.latest(job.id)
            if progress is None or told is None:
                now = await look(jobs, job)
                if seen is None or (now.state, now.attempt) != (seen.state, seen.attempt):
                    yield now
                seen = now
                if now.state.ended:
                    return
            if progress is not None and progress != told:
                yield progress
            told = progress
            try:
                await asyncio.wait_for(changed.wait(), quiet)
            except TimeoutError:
                told = None
                yield None


async def ended_within(
    jobs: JobStore, board: ProgressBoard, request: Request, job: Job, seconds: float
) -> Job:
    """The job when it has ended, the time is over, or whoever asks has gone."""
    if job.state.ended or seconds <= 0.0:
        return job
    with move_on_after(seconds):
        waiting = asyncio.ensure_future(_end_of(jobs, board, job))
        leaving = asyncio.ensure_future(_left(request))
        try:
            await asyncio.wait({waiting, leaving}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (waiting, leaving):
                task.cancel()
            await asyncio.gather(waiting, leaving, return_exceptions=True)
    return await look(jobs, job)


@dataclass(frozen=True)
class Patience:
    """For how long a request waits for a job's end, and what it wants where that does not come.

    ``seconds``  that it waits.
    ``result``   whether nothing but the result will do: then it is sent on to where that will be,
                 and waits there again, until there is an answer that is no "later".
    ``applied``  the preferences that were heard, for the answer.
    """

    seconds: float
    result: bool

    @classmethod
    def of(cls, request: Request, most: float) -> Self:
        """What the headers ask for, up to ``most`` seconds."""
        wishes = request.headers.getlist("prefer")
        seconds, result = wait_seconds(wishes, most), wants_result(wishes)
        # One that is sent on at once would be sent on again and again.
        return cls(max(seconds or most, _SHORTEST_HOP) if result else seconds, result)

    @property
    def applied(self) -> dict[str, str]:
        told = ["return=representation"] if self.result else []
        told += [f"wait={self.seconds:.0f}"] if self.seconds > 0.0 else []
        return {"Preference-Applied": ", ".join(told)} if told else {}

    def send_on(self, job: Job) -> Response:
        """To the result of a job that has not ended; by GET, whatever was asked (RFC 9110)."""
        place = f"/v1/jobs/{job.id}/result"
        return Response(status_code=303, headers={"Location": place, **self.applied})


async def _end_of(jobs: JobStore, board: ProgressBoard, job: Job) -> None:
    async for _ in news(jobs, board, job, _LOOK):
        pass


async def _left(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass
