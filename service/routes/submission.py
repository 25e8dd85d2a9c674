"""From an upload to its job, and to the job's result where it comes in time."""

from __future__ import annotations

from anyio.to_thread import run_sync
from fastapi import Request
from fastapi.responses import Response

from service.access.key import Caller
from service.errors import BadRequestError
from service.jobs.job import Job, JobFile, JobKind, JobState, Submission
from service.routes.formats import chosen_format
from service.routes.forms import read_form, read_idempotency_key
from service.routes.hearing import ended_within
from service.routes.jobs import shown
from service.routes.outcomes import problem_of_job
from service.routes.prefer import wait_seconds
from service.routes.results import result_answer
from service.routes.services import Services
from service.routes.uploads import Upload, read_upload


async def take_in(
    request: Request, services: Services, caller: Caller, kind: JobKind, parts: tuple[str, ...]
) -> Response:
    """Take an upload of some parts in as a job; a raw body is the first and only part.

    200 with the result where it is there within the time that ``Prefer`` says, else 202 with the
    job.  All that can be refused before the body has come is.  Raises
    :class:`~service.errors.ServiceError`, also for a job that has failed within that time.
    """
    media_type = chosen_format(request.headers.get("accept", ""), kind)
    key = read_idempotency_key(request)
    table = services.tables[kind]
    if not _in_parts(request):
        read_form(request, {}, table)
    with services.blobs.keeping() as keeping:
        upload = await read_upload(request, keeping, services.settings, parts)
        submission = await _submission(request, services, caller, kind, parts, upload, key)
        job, new = await run_sync(services.jobs.submit, submission, services.settings.queue_limit)
    if new:
        await run_sync(services.taken, job)
    return await _answer(request, services, job, media_type)


async def _submission(
    request: Request,
    services: Services,
    caller: Caller,
    kind: JobKind,
    parts: tuple[str, ...],
    upload: Upload,
    key: str | None,
) -> Submission:
    missing = [part for part in parts if part not in upload.files]
    if missing:
        raise BadRequestError(
            f"the form has no part '{missing[0]}'", remedy=f"send the parts {', '.join(parts)}"
        )
    form = read_form(request, upload.fields, services.tables[kind])
    if form.webhook is not None:
        await run_sync(services.check_webhook, form.webhook)
    inputs = tuple(
        JobFile(f"input/{part}{file.suffix}", file.blob, file.media_type, is_input=True)
        for part, file in upload.files.items()
    )
    return Submission(
        tenant=caller.tenant,
        kind=kind,
        name=upload.files[parts[0]].filename,
        options=form.options,
        inputs=inputs,
        version=services.version,
        asset=form.asset,
        webhook=form.webhook,
        idempotency_key=key,
        attempts=services.settings.attempts,
    )


async def _answer(request: Request, services: Services, job: Job, media_type: str) -> Response:
    seconds = wait_seconds(request.headers.getlist("prefer"), services.settings.max_wait)
    job = await ended_within(services, request, job, seconds)
    place = {"Location": f"/v1/jobs/{job.id}"}
    applied = {"Preference-Applied": f"wait={seconds:.0f}"} if seconds > 0.0 else {}
    if job.state is JobState.SUCCEEDED:
        response = await run_sync(result_answer, request, services, job, media_type)
        response.headers.update({**place, **applied})
        return response
    if job.state.ended:
        raise problem_of_job(job)
    body = shown(services, job).model_dump_json()
    return Response(body, 202, {**place, **applied}, "application/json")


def _in_parts(request: Request) -> bool:
    kind = request.headers.get("content-type", "").partition(";")[0]
    return kind.strip().lower() == "multipart/form-data"
