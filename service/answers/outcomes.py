"""What is answered for a job that did not succeed while somebody waited for it."""

from __future__ import annotations

from service.errors import (
    ConflictError,
    DiskFullError,
    FieldError,
    InvalidOptionsError,
    JobFailedError,
    NotReadyError,
    ServiceError,
    UnreadableMeshError,
)
from service.jobs.job import Failure, Job
from service.schemas.job import Failure as FailureBody

_KINDS: dict[str, type[ServiceError]] = {
    "unreadable-mesh": UnreadableMeshError,
    "disk-full": DiskFullError,
    "unavailable": NotReadyError,
}
"""Kinds of failure that are problems of their own; any other is a failed job."""


def problem_of_job(job: Job) -> ServiceError:
    """The problem, with where the job is; ``job`` has failed or was cancelled."""
    failure = job.failure
    if failure is None:
        return ConflictError(
            "the job was cancelled", remedy="POST to its 'retry'", extra={"job": _place(job)}
        )
    error = _of_failure(failure)
    error.extra |= {
        "job": _place(job),
        "failure": FailureBody.model_validate(failure, from_attributes=True).model_dump(),
    }
    return error


def _of_failure(failure: Failure) -> ServiceError:
    if failure.kind == "invalid-options":
        return InvalidOptionsError([FieldError("options", failure.detail, failure.remedy)])
    kind = _KINDS.get(failure.kind, JobFailedError)
    return kind(failure.detail, remedy=failure.remedy)


def _place(job: Job) -> str:
    return f"/v1/jobs/{job.id}"
