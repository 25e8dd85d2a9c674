"""What is done to jobs, whether a route or a page asks for it.

Each waits for the database, and raises :class:`~service.errors.ServiceError`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.access.key import Caller
from service.errors import ConflictError
from service.jobs.job import Job, JobKind, JobState, Priority, Submission, inputs_by_part
from service.routes.services import Services
from service.schemas.job_options import with_changes

_SWEPT = ("mesh", "overrides")
"""Parts of a run that a sweep takes: the run may be that of an occluder made elsewhere."""


def cancel(services: Services, caller: Caller, job_id: str) -> Job:
    """End a job: at once while it waits, soon while it runs.  Conflicts when it has ended."""
    job = services.jobs.cancel(caller.tenant, job_id)

    def tell() -> None:
        services.runner.wake()
        services.board.announce(job_id)
        if job.state.ended:
            services.on_end(job)

    services.answers.afterwards(tell)
    return job


def retry(services: Services, caller: Caller, job_id: str) -> Job:
    """Do a job once more that failed or was cancelled; conflicts for any other."""
    job = services.jobs.job(caller.tenant, job_id)
    if job.state not in (JobState.FAILED, JobState.CANCELLED):
        now = "has succeeded" if job.state is JobState.SUCCEEDED else f"is {job.state}"
        raise ConflictError(
            f"the job {now}; only jobs that have failed or were cancelled can be retried",
            remedy="POST to its 'rerun' with other options to have another result",
        )
    return _once_more(services, job, job.kind, job.options, retry_of=job.id)


def rerun(
    services: Services,
    caller: Caller,
    job_id: str,
    changes: Mapping[str, Any],
) -> Job:
    """Do other work with the same inputs; options that are not named stay as they were, but for
    those that cannot be given together with one that is.

    Raises :class:`~service.errors.InvalidOptionsError` that names each wrong one.
    """
    job = services.jobs.job(caller.tenant, job_id)
    table = services.tables[job.kind]
    # An older version may have had others.
    known = {one.name for one in table.fields}
    kept = {name: value for name, value in job.options.items() if name in known}
    return _once_more(services, job, job.kind, table.read(with_changes(kept, changes)))


def sweep(
    services: Services,
    caller: Caller,
    asset_id: str,
    options: Mapping[str, Any],
) -> Job:
    """Measure speed against accuracy on the mesh of an asset's latest run, with its overrides."""
    resolved = services.tables[JobKind.TRADEOFF].read(options)
    asset = services.assets.asset(caller.tenant, asset_id)
    if asset.latest is None or asset.latest.kind is JobKind.SCENE:
        raise ConflictError(
            f"the asset '{asset.name}' has no run with a mesh",
            remedy="submit a mesh as a run of it first",
        )
    return _once_more(services, asset.latest, JobKind.TRADEOFF, resolved)


def _once_more(
    services: Services,
    job: Job,
    kind: JobKind,
    options: Mapping[str, Any],
    retry_of: str | None = None,
) -> Job:
    """A new job with the inputs of another, as far as its kind takes them."""
    sweeps = kind is JobKind.TRADEOFF
    with services.blobs.keeping() as keeping:
        inputs = tuple(
            file
            for part, file in inputs_by_part(services.jobs.files(job.id)).items()
            if not sweeps or part in _SWEPT
        )
        try:
            for file in inputs:
                keeping.adopt(file.blob)
        except KeyError:
            raise ConflictError(
                "the uploaded file of the job is no longer stored", remedy="send it again"
            ) from None
        submission = Submission(
            tenant=job.tenant, kind=kind, name=job.name, options=options, inputs=inputs,
            version=services.version, asset=job.asset,
            webhook=job.webhook if kind is job.kind else None,
            attempts=services.settings.attempts,
            priority=job.priority if retry_of else Priority.INTERACTIVE, keep=job.keep,
            may_reuse=not sweeps,  # whoever measures again wants the times of today
            retry_of=retry_of,
        )  # fmt: skip
        return services.submit(submission)
