"""What is answered for a job that has no result."""

from __future__ import annotations

from typing import Any

from service.errors import (
    ConflictError,
    DiskFullError,
    FieldError,
    InvalidOptionsError,
    InvalidOverridesError,
    JobFailedError,
    NotReadyError,
    ServiceError,
    UnreadableMeshError,
)
from service.jobs.job import Failure, Job
from service.schemas.job import Failure as FailureBody

_KINDS: dict[str, type[ServiceError]] = {
    "unreadable-mesh": UnreadableMeshError,
    "invalid-overrides": InvalidOverridesError,
    "disk-full": DiskFullError,
    "unavailable": NotReadyError,
}
"""Kinds of failure that are problems of their own; any other is a failed job."""


def problem_of_job(job: Job) -> ServiceError:
    """Why there is no result for whoever waited for it; ``job`` has failed or was cancelled."""
    if job.failure is None:
        return problem_of_state(job)
    error = _of_failure(job.failure)
    error.extra |= _about(job)
    return error


def problem_of_state(job: Job) -> ConflictError:
    """Why there is no result to be had of a job that has not succeeded."""
    if job.failure is not None:
        detail, remedy = f"the job has failed: {job.failure.detail}", job.failure.remedy
    else:
        detail = f"the job is {job.state}"
        again = "POST to its 'retry'"
        remedy = again if job.state.ended else "follow its 'events', or ask again later"
    return ConflictError(detail, remedy=remedy, extra=_about(job))


def _of_failure(failure: Failure) -> ServiceError:
    if failure.kind == "invalid-options":
        return InvalidOptionsError([FieldError("options", failure.detail, failure.remedy)])
    kind = _KINDS.get(failure.kind, JobFailedError)
    return kind(failure.detail, remedy=failure.remedy)


def _about(job: Job) -> dict[str, Any]:
    """Where the job is, and why it failed."""
    about: dict[str, Any] = {"job": f"/v1/jobs/{job.id}"}
    if job.failure is not None:
        failure = FailureBody.model_validate(job.failure, from_attributes=True)
        about["failure"] = failure.model_dump()
    return about
