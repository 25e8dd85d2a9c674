"""From an upload to its job, and to the job's result where it comes in time.

Options, the asset and the webhook come along with the upload: by query, or as parts of its form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any

from anyio.to_thread import run_sync
from fastapi import Request
from fastapi.responses import Response

from service.access.key import Caller
from service.answers.files import chosen_format
from service.answers.following import Patience, ended_within
from service.answers.problems import problem_of_job
from service.errors import (
    FieldError,
    IdempotencyKeyReusedError,
    InvalidOptionsError,
    QueueFullError,
)
from service.headers import idempotency_key
from service.idempotency import Answer, KeyedRequest
from service.jobs.asset import asset_name
from service.jobs.job import Job, JobKind, JobState, Priority, Submission
from service.jobs.stores import LONGEST_URL
from service.keep import Keep
from service.routes.jobs import job_body
from service.routes.once import REPLAYED, kept_response
from service.routes.results import answer_with_result
from service.routes.services import Services
from service.schemas.options import OptionTable
from service.uploads.receiving import Uploads, Wanted, receive

_SHORT = 1 << 20  # bytes

_LONGEST_ECHO = 40  # characters

_FOR_UPLOADS = "filename"  # which says the format of a raw body


def _webhook(text: str) -> str:
    """A webhook, as far as its length goes; the rest is judged by who sends it."""
    if not 1 <= len(text) <= LONGEST_URL:
        raise ValueError(f"it has {len(text)} characters, and may have 1 to {LONGEST_URL}")
    return text


def _one_of(words: type[StrEnum], text: str) -> StrEnum:
    known = [str(one) for one in words]
    if text not in known:
        raise ValueError(f"it is {text[:_LONGEST_ECHO]!a}, and may be {' or '.join(known)}")
    return words(text)


_LABELS: Mapping[str, Callable[[str], str]] = {
    "asset": asset_name,
    "webhook": _webhook,
    "priority": partial(_one_of, Priority),
    "keep": partial(_one_of, Keep),
}
"""What comes beside the options; each as it is kept, or a ValueError that says what is wrong."""


async def submit_upload(
    request: Request, services: Services, caller: Caller, kind: JobKind, parts: Sequence[Wanted]
) -> Response:
    """Make a job of an upload of some parts; a raw body is the first and only part.

    200 with the result where it is there within the time that ``Prefer`` says, else 202 with the
    job, or 303 to its result where ``Prefer`` asks for nothing else.  All that can be refused
    before the body has come is.  Raises :class:`~service.errors.ServiceError`, also for a job that
    has failed within that time.
    """
    media_type = chosen_format(request.headers.get("accept", ""), kind)
    key = idempotency_key(request.headers)
    table = services.tables[kind]
    if not _in_parts(request):
        read_form(request, {}, table)
    if key is None or not await run_sync(services.answers.known, caller.tenant, key):
        await _check_room(request, services, caller)
    with services.blobs.keeping() as keeping:
        uploads = await receive(request, keeping, parts, services.settings)
        submission = await _submission(request, services, caller, kind, parts, uploads)
        take_in = partial(_take_in, services, caller, submission, key)
        taken = await run_sync(take_in, limiter=services.submitting)
    patience = Patience.of(request, services.settings.max_wait)
    waits = patience.seconds > 0.0 or patience.result
    if taken.replayed is not None and taken.replayed.status == 202 and not waits:
        return kept_response(taken.replayed)
    response = await _answer(request, services, caller, taken.job, media_type, patience)
    if taken.replayed is not None:
        response.headers[REPLAYED] = "true"
    return response


@dataclass(frozen=True)
class _Taken:
    """A job that was taken in, and the answer that this had, where it was before."""

    job: Job
    replayed: Answer | None = None


def _take_in(services: Services, caller: Caller, submission: Submission, key: str | None) -> _Taken:
    """Make a job, or find the one that the same key gave; waits for the database.

    The answer that is kept is that to an upload which waits for nothing: the job as it is taken in.
    One that has succeeded at once is told by its result, which never changes.
    """
    if key is None:
        return _Taken(services.submit(submission))
    services.check_stored_result(submission)
    jobs: list[Job] = []

    def take_in() -> Answer:
        job = services.take_in(submission)
        jobs.append(job)
        place = {"Location": f"/v1/jobs/{job.id}", "Content-Type": "application/json"}
        if job.state.ended:
            return Answer(200, job_id=job.id)
        body = job_body(services, caller, job).model_dump_json().encode()
        return Answer(202, place, body, job.id)

    request = KeyedRequest(caller.tenant, key, submission.fingerprint)
    answer, replayed = services.answers.once(request, take_in)
    if not replayed:
        return _Taken(jobs[0])
    if answer.job_id is None:
        raise IdempotencyKeyReusedError(key)
    return _Taken(services.jobs.job(caller.tenant, answer.job_id), answer)


async def _check_room(request: Request, services: Services, caller: Caller) -> None:
    """A full queue is told before the body is read: else those it refuses would fill the server."""
    limit = services.settings.queue_limit
    try:
        await run_sync(services.jobs.check_room, caller.tenant, limit)
    except QueueFullError as refusal:
        if not _is_short(request):
            refusal.headers["Connection"] = "close"
        raise


async def _submission(
    request: Request,
    services: Services,
    caller: Caller,
    kind: JobKind,
    parts: Sequence[Wanted],
    uploads: Uploads,
) -> Submission:
    form = read_form(request, uploads.texts, services.tables[kind])
    if form.webhook is not None:
        await services.check_webhook(form.webhook)
    return Submission(
        tenant=caller.tenant,
        kind=kind,
        name=uploads.files[parts[0].name].label,
        options=form.options,
        inputs=tuple(file.job_file for file in uploads.files.values()),
        version=services.version,
        asset=form.asset,
        webhook=form.webhook,
        priority=form.priority,
        keep=form.keep or services.settings.keep,
        attempts=services.settings.attempts,
    )


async def _answer(
    request: Request,
    services: Services,
    caller: Caller,
    job: Job,
    media_type: str,
    patience: Patience,
) -> Response:
    job = await ended_within(services.jobs, services.board, request, job, patience.seconds)
    place = {"Location": f"/v1/jobs/{job.id}"}
    if job.state is JobState.SUCCEEDED:
        response = await answer_with_result(request, services, caller, job, media_type)
        response.headers.update({**place, **patience.applied})
        return response
    if job.state.ended:
        raise problem_of_job(job)
    if patience.result:
        return patience.send_on(job)
    body = job_body(services, caller, job).model_dump_json()
    return Response(body, 202, {**place, **patience.applied}, "application/json")


def _is_short(request: Request) -> bool:
    """Whether the body is read sooner than another connection is made."""
    told = request.headers.get("content-length", "")
    return told.isascii() and told.isdigit() and int(told) <= _SHORT


def _in_parts(request: Request) -> bool:
    kind = request.headers.get("content-type", "").partition(";")[0]
    return kind.strip().lower() == "multipart/form-data"


@dataclass(frozen=True)
class Form:
    """What is wanted of an upload, checked.

    ``options``  all of them, by keyword.
    ``keep``     None where it is left to the service.
    """

    options: Mapping[str, Any]
    asset: str | None
    webhook: str | None
    priority: Priority
    keep: Keep | None


def read_form(request: Request, parts: Mapping[str, str], table: OptionTable) -> Form:
    """A form, from the query and from parts of text; either may say a thing, not both.

    Raises :class:`~service.errors.InvalidOptionsError` that names each wrong field.
    """
    asked = request.query_params.multi_items()
    filenames = sum(name == _FOR_UPLOADS for name, _ in asked)
    asked = [pair for pair in asked if pair[0] != _FOR_UPLOADS]
    options = table.from_query(pair for pair in asked if pair[0] not in _LABELS)
    more = table.from_json(parts["options"]) if parts.get("options") else {}
    labels = [pair for pair in (*asked, *parts.items()) if pair[0] in _LABELS]
    both = [name for name in options if name in more]
    both += [_FOR_UPLOADS] if filenames > 1 else []
    both += [name for name in _LABELS if sum(one == name for one, _ in labels) > 1]
    faults = [FieldError(name, "it is given twice", "give it once") for name in both]
    said = dict(labels)
    for name, check in _LABELS.items():
        if name in said:
            try:
                said[name] = check(said[name])
            except ValueError as error:
                faults.append(FieldError(name, str(error), "choose another, or leave it out"))
    resolved = _collect_faults(faults, lambda: table.read({**options, **more}))
    if faults:
        raise InvalidOptionsError(faults)
    priority = Priority(said.get("priority", Priority.INTERACTIVE))
    keep = Keep(said["keep"]) if "keep" in said else None
    return Form(resolved, said.get("asset"), said.get("webhook"), priority, keep)


def _collect_faults(faults: list[FieldError], read: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What was read; its faults go to the others, so that all are told at once."""
    try:
        return read()
    except InvalidOptionsError as error:
        faults.extend(error.errors)
        return {}
