"""Jobs on the wire; times are ISO 8601, UTC."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from typing import Annotated, Any, Self
from urllib.parse import urlsplit

from pydantic import AwareDatetime, BaseModel, BeforeValidator, Field

from service.jobs.job import Job, JobKind, JobState, Priority, Summary
from service.jobs.progress import JobProgress
from service.keep import Keep
from simplifier import VerdictWord

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class AssetName(BaseModel):
    """An asset, in short."""

    id: str
    name: str = Field(examples=["props/castle"])


class ProgressBody(BaseModel):
    """How far a running job is."""

    stage: str = Field(description="What is being done.", examples=["refine"])
    fraction: float = Field(ge=0, le=1, description="Of the whole job; never falls in an attempt.")
    measure: float | None = Field(
        description="Share of the original's occlusion measure that the best so far has."
    )
    level: int = Field(ge=0, description="Level of detail that is made, from 0.")
    levels: int = Field(ge=0, description="How many there will be.")
    seconds: float = Field(ge=0, description="Time taken so far.")
    picture: str | None = Field(
        description="Where a picture of the best so far is; another address for each.",
        examples=["/v1/jobs/j_7Qk2/picture?n=3"],
    )

    @classmethod
    def of(cls, job_id: str, progress: JobProgress) -> Self:
        return cls(
            stage=progress.stage,
            fraction=progress.fraction,
            measure=progress.measure,
            level=progress.level,
            levels=progress.levels,
            seconds=progress.seconds,
            picture=picture_link(job_id, progress),
        )


def picture_link(job_id: str, progress: JobProgress) -> str | None:
    """The address of the picture that the job has now."""
    if progress.picture is None:
        return None
    return f"/v1/jobs/{job_id}/picture?n={progress.picture.number}"


class FailureBody(BaseModel):
    """Why a job failed."""

    kind: str = Field(description="A word that stays the same.", examples=["unreadable-mesh"])
    detail: str = Field(description="What was wrong.")
    remedy: str = Field(description="What to do; may be empty.")


class SummaryBody(BaseModel):
    """The numbers of a result; null where the kind of job has none."""

    triangles: int = Field(
        description="Of the finest occluder; of all, for a scene; 0 for visible sets."
    )
    input_triangles: int = Field(description="Of what was sent.")
    levels: int = Field(
        description="Levels of detail; occluders, for a scene; cells, for visible sets."
    )
    seconds: float = Field(description="Time that the work took.")
    precision: float | None = Field(description="Of what is hidden, the share rightly so, 0 to 1.")
    recall: float | None = Field(description="Of what could be hidden, the share that is, 0 to 1.")
    worst_recall: float | None = Field(description="In the worst view.")
    worst_view: int | None = Field(description="Number of that view.")
    overhang: float | None = Field(
        description="Covered beside the mesh, as a share of its silhouette; mean over all views."
    )
    verdict: VerdictWord | None = Field(description="Whether it is good for an engine.")
    reason: str | None = Field(description="Of the verdict, from the figures.")
    try_next: str | None = Field(description="A command to try, where it is not good.")
    error_bound: float | None = Field(description="Of the finest occluder, in the mesh's units.")
    timings: dict[str, float] = Field(description="Seconds by stage.")
    warnings: list[str] = Field(description="What the owner should know, a sentence each.")

    @classmethod
    def of(cls, summary: Summary) -> Self:
        return cls.model_validate(summary, from_attributes=True)


class JobLinks(BaseModel):
    """Where to go on from a job."""

    self: str = Field(examples=["/v1/jobs/j_7Qk2"])
    events: str
    cancel: str
    retry: str
    rerun: str
    result: str
    files: str

    @classmethod
    def of(cls, job_id: str) -> Self:
        place = f"/v1/jobs/{job_id}"
        return cls(
            self=place,
            events=f"{place}/events",
            cancel=f"{place}/cancel",
            retry=f"{place}/retry",
            rerun=f"{place}/rerun",
            result=f"{place}/result",
            files=f"{place}/files",
        )


class JobBody(BaseModel):
    """A piece of work: what was asked, how far it is, what came of it."""

    id: str
    kind: JobKind
    state: JobState = Field(description="The last three are for good.")
    name: str = Field(description="Of the file that was sent.", examples=["castle.glb"])
    asset: AssetName | None = Field(description="Whose run this is.")
    created: datetime
    started: datetime | None
    ended: datetime | None
    attempt: int = Field(description="How often it was begun.")
    attempts: int = Field(
        description="How often it may be: one more for each attempt that does not count, as when "
        "the server stops."
    )
    priority: Priority = Field(description="Its place among your own jobs.")
    keep: Keep = Field(
        description="Which files of an occluder's or an evaluation's result are stored as it ends; "
        "the others are made on demand."
    )
    options: dict[str, Any] = Field(description="All of them, defaults included.")
    version: str = Field(description="Of the library that does it.")
    progress: ProgressBody | None = Field(
        description="While it runs; and while it waits for the service's first start, by the stage "
        "`preparing`."
    )
    failure: FailureBody | None = Field(description="When it has failed.")
    summary: SummaryBody | None = Field(description="When it has succeeded.")
    reused: str | None = Field(description="The job whose stored result it was given.")
    retry_of: str | None = Field(description="The job that it does again.")
    request_id: str | None = Field(
        description="`X-Request-Id` of the request that made it; its webhook has it too."
    )
    trace: str | None = Field(
        description="`traceparent` of that request, where the service sends traces."
    )
    webhook: str | None = Field(
        description="Who is told when it ends; keys that only read see no more than the host.",
        examples=["https://ci.example.org/hooks/7f3a"],
    )
    links: JobLinks

    @classmethod
    def of(cls, job: Job, progress: JobProgress | None = None, *, whole_webhook: bool) -> Self:
        """``progress`` is left out of a job that has ended, the path of the webhook unless told."""
        shown = None if job.state.ended else progress
        named = job.asset_id is not None and job.asset is not None
        failure, summary = job.failure, job.summary
        put_otherwise: dict[str, Any] = {
            "asset": AssetName(id=job.asset_id or "", name=job.asset or "") if named else None,
            "created": moment(job.created),
            "started": moment_or_none(job.started),
            "ended": moment_or_none(job.ended),
            "options": dict(job.options),
            "progress": ProgressBody.of(job.id, shown) if shown else None,
            "failure": FailureBody.model_validate(failure, from_attributes=True)
            if failure
            else None,
            "summary": SummaryBody.of(summary) if summary else None,
            "webhook": job.webhook
            if whole_webhook
            else origin(job.webhook)
            if job.webhook
            else None,
            "links": JobLinks.of(job.id),
        }
        by_name = {
            name: getattr(job, name) for name in cls.model_fields if name not in put_otherwise
        }
        return cls(**by_name, **put_otherwise)


def origin(url: str) -> str:
    """Scheme and host of an address, whose path may be what its owner lets others in by."""
    parts = urlsplit(url)
    return f"{parts.scheme}://{parts.netloc}"


class JobPageBody(BaseModel):
    """Jobs, newest first."""

    items: list[JobBody]
    next: str | None = Field(description="Where the next page is; null on the last.")


def moment(seconds: float) -> datetime:
    """The time of Unix seconds, cut to microseconds.

    Never later than it was, so that a list from the time that a job shows has that job.
    """
    return _EPOCH + timedelta(microseconds=math.floor(Fraction(seconds) * 1_000_000))


def moment_or_none(seconds: float | None) -> datetime | None:
    return None if seconds is None else moment(seconds)


def _written_out(text: object) -> object:
    if not isinstance(text, str) or not re.match(r"\d{4}-\d\d-\d\dT", text):
        raise ValueError("should be a time such as 2026-01-31T12:00:00Z")
    return text


Moment = Annotated[AwareDatetime, BeforeValidator(_written_out)]
"""A time that a request gives, with its offset from UTC; no count of seconds."""
