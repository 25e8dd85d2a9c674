"""Jobs: list, one, cancel, retry."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from service.access.key import Caller, Scope
from service.answers.pages import LARGEST_NUMBER, next_page
from service.errors import ConflictError
from service.headers.idempotency_key import IDEMPOTENCY_KEY, idempotency_key
from service.jobs.job import Job as StoredJob
from service.jobs.job import JobKind, JobState, Submission
from service.jobs.stores import JobFilter
from service.routes.callers import KEYED, Reader, Writer
from service.routes.services import Services, TheServices
from service.schemas.job import Job, JobPage
from service.schemas.moment import Moment
from service.schemas.openapi import EVERYWHERE, header, refusals

router = APIRouter(prefix="/v1", tags=["jobs"], dependencies=KEYED)


class WantedJobs(BaseModel):
    """Which jobs to list."""

    model_config = ConfigDict(extra="forbid")

    state: list[JobState] = Field([], description="One or more states.", max_length=5)
    kind: list[JobKind] = Field([], description="One or more kinds.", max_length=3)
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
) -> JobPage:
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
    return JobPage(
        items=[shown(services, caller, job) for job in page.jobs],
        next=next_page("/v1/jobs", wanted, page.cursor),
    )


@router.get("/jobs/{job_id}", responses=refusals(*EVERYWHERE, 404), summary="Look at a job")
def get_job(job_id: str, services: TheServices, caller: Reader) -> Job:
    """The job, and how far it is while it runs."""
    return shown(services, caller, services.jobs.job(caller.tenant, job_id))


@router.post(
    "/jobs/{job_id}/cancel", responses=refusals(*EVERYWHERE, 404, 409), summary="Cancel a job"
)
def cancel_job(job_id: str, services: TheServices, caller: Writer) -> Job:
    """End it: at once while it waits, within a second while it runs. 409 when it has ended."""
    job = services.jobs.cancel(caller.tenant, job_id)
    services.work.wake()
    services.board.changed(job_id)
    if job.state.ended:
        services.ended(job)
    return shown(services, caller, job)


@router.post(
    "/jobs/{job_id}/retry",
    status_code=202,
    response_description="The new job.",
    responses={
        202: {"headers": {"Location": header("The new job.", required=True)}},
        **refusals(*EVERYWHERE, 404, 409, 507),
    },
    openapi_extra={"parameters": [IDEMPOTENCY_KEY]},
    summary="Do a job again",
)
def retry_job(
    job_id: str, request: Request, response: Response, services: TheServices, caller: Writer
) -> Job:
    """A new job with the same mesh and options, for one that failed or was cancelled."""
    key = idempotency_key(request.headers)
    job = _again(services, services.jobs.job(caller.tenant, job_id), key)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return shown(services, caller, job)


def shown(services: Services, caller: Caller, job: StoredJob) -> Job:
    """As it goes over the wire, its progress included."""
    progress = services.board.latest(job.id)
    return Job.of(job, progress, whole_webhook=caller.may(Scope.WRITE))


def _again(services: Services, job: StoredJob, key: str | None) -> StoredJob:
    if job.state not in (JobState.FAILED, JobState.CANCELLED):
        raise ConflictError(
            f"the job is {job.state}, and only failed and cancelled ones are done again",
            remedy="send the mesh again with other options to have another result",
        )
    with services.blobs.keeping() as keeping:
        inputs = tuple(file for file in services.jobs.files(job.id) if file.is_input)
        try:
            for file in inputs:
                keeping.adopt(file.blob)
        except KeyError:
            raise ConflictError(
                "what was sent for the job is stored no more", remedy="send it again"
            ) from None
        submission = Submission(
            tenant=job.tenant, kind=job.kind, name=job.name, options=job.options, inputs=inputs,
            version=services.version, asset=job.asset, webhook=job.webhook, idempotency_key=key,
            attempts=services.settings.attempts, retry_of=job.id,
        )  # fmt: skip
        again, new = services.jobs.submit(submission, services.settings.queue_limit)
    if new:
        services.taken(again)
    return again
