"""Jobs: listed page by page, looked at, cancelled, and done again, as they were or otherwise."""

from __future__ import annotations

from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from service.access.key import Caller, Scope
from service.jobs.job import Job, JobKind, JobState
from service.jobs.stores import JobFilter
from service.routes import actions
from service.routes.docs import EVERYWHERE, NEW_JOB, refusals
from service.routes.once import OnceRoute
from service.routes.services import KEYED, Reader, Services, TheServices, Writer
from service.schemas.job import JobBody, JobPageBody, Moment

router = APIRouter(prefix="/v1", tags=["jobs"], dependencies=KEYED, route_class=OnceRoute)


LARGEST_NUMBER = 2**63 - 1
"""That the database can hold."""


class WantedJobs(BaseModel):
    """Which jobs to list."""

    model_config = ConfigDict(extra="forbid")

    state: list[JobState] = Field([], description="One or more states.", max_length=len(JobState))
    kind: list[JobKind] = Field([], description="One or more kinds.", max_length=len(JobKind))
    asset: str | None = Field(None, description="Id of an asset.")
    created_from: Moment | None = Field(None, description="Not older than this.")
    created_before: Moment | None = Field(None, description="Older than this.")
    cursor: Annotated[int, Field(ge=1, le=LARGEST_NUMBER)] | None = Field(
        None, description="From `next` of the page before."
    )
    limit: int = Field(100, ge=1, le=500, description="Most jobs of a page.")


@router.get("/jobs", responses=refusals(*EVERYWHERE), summary="List jobs")
def list_jobs(
    wanted: Annotated[WantedJobs, Query()], services: TheServices, caller: Reader
) -> JobPageBody:
    """Jobs of yours, newest first."""
    begun, ended = wanted.created_from, wanted.created_before
    page = services.jobs.jobs(
        caller.tenant,
        JobFilter(
            states=frozenset(wanted.state),
            kinds=frozenset(wanted.kind),
            asset_id=wanted.asset,
            created_from=begun.timestamp() if begun else None,
            created_before=ended.timestamp() if ended else None,
        ),
        before=wanted.cursor,
        limit=wanted.limit,
    )
    return JobPageBody(
        items=[job_body(services, caller, job) for job in page.jobs],
        next=next_page("/v1/jobs", wanted, page.cursor),
    )


@router.get("/jobs/{job_id}", responses=refusals(*EVERYWHERE, 404), summary="Look at a job")
def get_job(job_id: str, services: TheServices, caller: Reader) -> JobBody:
    """The job, and how far it is while it runs."""
    return job_body(services, caller, services.jobs.job(caller.tenant, job_id))


@router.post(
    "/jobs/{job_id}/cancel", responses=refusals(*EVERYWHERE, 404, 409), summary="Cancel a job"
)
def cancel_job(job_id: str, services: TheServices, caller: Writer) -> JobBody:
    """End it: at once while it waits, within a second while it runs. 409 when it has ended."""
    return job_body(services, caller, actions.cancel(services, caller, job_id))


@router.post(
    "/jobs/{job_id}/retry",
    status_code=202,
    response_description="The new job.",
    responses={
        202: NEW_JOB,
        **refusals(*EVERYWHERE, 404, 409, 507),
    },
    summary="Do a job again",
)
def retry_job(job_id: str, response: Response, services: TheServices, caller: Writer) -> JobBody:
    """A new job with the same mesh and options, for one that failed or was cancelled."""
    job = actions.retry(services, caller, job_id)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return job_body(services, caller, job)


class OtherOptions(BaseModel):
    """What is to be different."""

    model_config = ConfigDict(extra="forbid")

    options: dict[str, Any] = Field(
        description="By name; those that are left out stay as they were, but for those that cannot "
        "be given together with one of these.",
        examples=[{"budget": 32, "preset": "best"}],
    )


@router.post(
    "/jobs/{job_id}/rerun",
    status_code=202,
    response_description="The new job; it has succeeded already where the result was stored.",
    responses={202: NEW_JOB, **refusals(*EVERYWHERE, 404, 409, 413, 415, 507)},
    summary="Run with other options",
)
def rerun_job(
    job_id: str,
    other: OtherOptions,
    response: Response,
    services: TheServices,
    caller: Writer,
) -> JobBody:
    """A new job with what was sent for this one, and other options."""
    job = actions.rerun(services, caller, job_id, other.options)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return job_body(services, caller, job)


def job_body(services: Services, caller: Caller, job: Job) -> JobBody:
    """A job as it goes over the wire to whoever asks, its progress included."""
    return JobBody.of(job, services.board.how_far(job), whole_webhook=caller.may(Scope.WRITE))


def next_page(path: str, wanted: BaseModel, cursor: int | str | None) -> str | None:
    """The address of the same list from a cursor on; None where it ends."""
    if cursor is None:
        return None
    asked = wanted.model_dump(mode="json", exclude_unset=True)
    return f"{path}?{urlencode({**asked, 'cursor': cursor}, doseq=True)}"
