"""What pages show of jobs, as plain values.  All functions wait for the database."""

from __future__ import annotations

from dataclasses import dataclass

from service.dashboard.jobs.words import failure_title, sentence, stage_words
from service.dashboard.visitor import Visitor
from service.jobs.job import Job, JobKind, JobState
from service.jobs.progress import JobProgress
from service.jobs.stores import JobFilter

SHOWN = 50
"""Jobs that wait or run, and jobs of a page of those that have ended."""

ENDED = frozenset(state for state in JobState if state.ended)


@dataclass(frozen=True)
class JobLine:
    """A job in a table.

    ``place``     in the queue, from 1, among the jobs of all tenants; None unless it waits.
    ``stage``     what is being done, in words; with the ``fraction`` of the whole job, 0 to 1.
    ``reason``, ``remedy``  sentences, of a job that failed; else empty.
    ``created``, ``ended``  Unix seconds.
    """

    id: str
    kind: JobKind
    state: JobState
    name: str
    asset: str | None
    asset_id: str | None
    created: float
    ended: float | None
    attempt: int
    attempts: int
    place: int | None = None
    stage: str = ""
    fraction: float = 0.0
    seconds: float = 0.0
    precision: float | None = None
    recall: float | None = None
    overhang: float | None = None
    verdict: str | None = None
    verdict_reason: str = ""
    triangles: int | None = None
    title: str = ""
    reason: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class JobsNow:
    """What has not ended: running, oldest first, and the next that wait."""

    running: tuple[JobLine, ...]
    queued: tuple[JobLine, ...]


@dataclass(frozen=True)
class EndedPage:
    """Jobs that have ended, newest first, and the cursor of the next page; None on the last."""

    lines: tuple[JobLine, ...]
    cursor: int | None


def jobs_now(visitor: Visitor) -> JobsNow:
    """The jobs of whoever asks.  Raises :class:`~service.errors.ServiceError`, as all of these."""
    services, tenant = visitor.services, visitor.caller().tenant
    running = services.jobs.jobs(
        tenant, JobFilter(states=frozenset([JobState.RUNNING])), before=None, limit=SHOWN
    )
    return JobsNow(
        tuple(line_of(job, services.board.how_far(job)) for job in reversed(running.jobs)),
        tuple(line_of(job, place=place) for place, job in services.jobs.queue(tenant, SHOWN)),
    )


def ended_page(
    visitor: Visitor, states: frozenset[JobState] = ENDED, before: int | None = None
) -> EndedPage:
    """A page of jobs that are in one of some states for good."""
    page = visitor.services.jobs.jobs(
        visitor.caller().tenant, JobFilter(states=states), before=before, limit=SHOWN
    )
    return EndedPage(tuple(map(line_of, page.jobs)), page.cursor)


def job_line(visitor: Visitor, job_id: str) -> JobLine:
    """One job, with its place while it waits."""
    services, tenant = visitor.services, visitor.caller().tenant
    job = services.jobs.job(tenant, job_id)
    place = None
    if job.state is JobState.QUEUED:
        place = services.jobs.place(job.number)
    return line_of(job, services.board.how_far(job), place)


def line_of(job: Job, progress: JobProgress | None = None, place: int | None = None) -> JobLine:
    summary, failure = job.summary, job.failure
    told = None if job.state.ended else progress
    return JobLine(
        id=job.id, kind=job.kind, state=job.state, name=job.name, asset=job.asset,
        asset_id=job.asset_id, created=job.created, ended=job.ended, attempt=job.attempt,
        attempts=job.attempts, place=place,
        stage=progress_words(told) if told else "",
        fraction=told.fraction if told else 0.0,
        seconds=told.seconds if told else summary.seconds if summary else 0.0,
        precision=summary.precision if summary else None,
        recall=summary.recall if summary else None,
        overhang=summary.overhang if summary else None,
        verdict=summary.verdict if summary else None,
        verdict_reason=(summary.reason or "") if summary else "",
        triangles=summary.triangles if summary else None,
        title=failure_title(failure) if failure else "",
        reason=sentence(failure.detail) if failure else "",
        remedy=sentence(failure.remedy) if failure else "",
    )  # fmt: skip


def progress_words(progress: JobProgress) -> str:
    """What is being done, and to which of several."""
    words = stage_words(progress.stage)
    if progress.stage == "runs":
        return f"{words}, {progress.level} of {progress.levels} done"
    if progress.levels > 1:
        return f"{words}, level {progress.level + 1} of {progress.levels}"
    return words
