"""What jobs have made: the result as a whole, and each file."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated, Any

from anyio.to_thread import run_sync
from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from service.access.key import Caller
from service.answers.files import (
    FORMATS,
    JSON,
    chosen_format,
    lead_to_file,
    read_file,
    send_file,
)
from service.answers.following import Patience, ended_within
from service.answers.problems import problem_of_state
from service.answers.zipped import send_zip
from service.errors import JobFailedError, NotAcceptableError, NotFoundError
from service.jobs.job import Job as StoredJob
from service.jobs.job import JobFile, JobState
from service.jobs.on_demand import can_be_made, carried_away, on_demand
from service.jobs.stores import BlobStore
from service.routes.docs import (
    CONDITIONS,
    EVERYWHERE,
    FILE,
    HEAD,
    LED,
    PARTS,
    PREFER,
    RESULT,
    SENT_ON,
    ZIPPED,
    refusals,
)
from service.routes.jobs import job_body
from service.routes.services import KEYED, Reader, Services, TheServices
from service.schemas.result import FilePage, LaterFile, Result, ResultFile, names_of

router = APIRouter(prefix="/v1", tags=["results"], dependencies=KEYED)


@router.get(
    "/jobs/{job_id}/result",
    response_class=Response,
    responses={**RESULT, **PARTS, **SENT_ON, **refusals(*EVERYWHERE, 404, 406, 409, 416, 507)},
    openapi_extra={"parameters": [*CONDITIONS["parameters"], PREFER]},
    summary="What a job has made",
)
async def get_result(
    job_id: str, request: Request, services: TheServices, caller: Reader
) -> Response:
    """The report with links to all files; or one file, where `Accept` asks for its format.

    409 while the job has not ended, unless `Prefer` says to wait.
    """
    job = await run_sync(services.jobs.job, caller.tenant, job_id)
    media_type = chosen_format(request.headers.get("accept", ""), job.kind)
    patience = Patience.of(request, services.settings.max_wait)
    job = await ended_within(services.jobs, services.board, request, job, patience.seconds)
    if patience.result and not job.state.ended:
        return patience.send_on(job)
    if job.state is not JobState.SUCCEEDED:
        raise problem_of_state(job)
    return await answer_with_result(request, services, caller, job, media_type)


@router.get(
    "/jobs/{job_id}/files", responses=refusals(*EVERYWHERE, 404), summary="List a job's files"
)
def list_files(job_id: str, services: TheServices, caller: Reader) -> FilePage:
    """What was sent, and what was made of it, by name; and what is made as soon as it is asked
    for."""
    job = services.jobs.job(caller.tenant, job_id)
    files = services.jobs.files(job.id)
    return FilePage(
        items=[ResultFile.of(job.id, file) for file in files],
        on_demand=[LaterFile.of(job.id, name) for name in on_demand(job, names_of(files))],
    )


@router.get(
    "/jobs/{job_id}/files.zip",
    response_class=Response,
    responses={**ZIPPED, **refusals(*EVERYWHERE, 404, 409, 507)},
    summary="All results of a job as a zip",
)
async def get_zip(job_id: str, services: TheServices, caller: Reader) -> Response:
    """What a job has made, in every format and with the pages of its report; not what was sent.

    It is packed while it is sent, so its length is not known before. What comes on demand is made
    first; what can no longer be made is left out.
    """
    job = await run_sync(services.jobs.job, caller.tenant, job_id)
    if job.state is not JobState.SUCCEEDED:
        raise problem_of_state(job)
    return send_zip(services.blobs, job, await _all_results(services, job))


async def _all_results(services: Services, job: StoredJob) -> list[JobFile]:
    """What is of use elsewhere, by name."""
    files: Sequence[JobFile] = await run_sync(services.jobs.files, job.id)
    for name in carried_away(on_demand(job, names_of(files))):
        with suppress(NotFoundError, JobFailedError):
            files = await _files_with(services, job, name)
    made = {file.name: file for file in files if not file.is_input}
    return [made[name] for name in carried_away(made)]


@router.get(
    "/jobs/{job_id}/files/{name:path}",
    response_class=Response,
    responses={**FILE, **PARTS, **LED, **refusals(*EVERYWHERE, 404, 416, 507)},
    openapi_extra=CONDITIONS,
    summary="A file of a job",
)
async def get_file(
    job_id: str,
    name: str,
    request: Request,
    services: TheServices,
    caller: Reader,
    redirect: Annotated[
        bool,
        Query(
            description="Whether 307 may lead to where the bytes are, if that is a bucket: for a "
            "quarter of an hour, to anybody, and without comparing them with the SHA-256."
        ),
    ] = False,
) -> Response:
    """Its bytes, whole or, by `Range` and `If-Range`, in part. It never changes; its ETag is the
    SHA-256 of it. What comes on demand is made when it is first asked for, and is the same
    from then on."""
    job = await run_sync(services.jobs.job, caller.tenant, job_id)
    files = await _files_with(services, job, name)
    return await run_sync(_file_answer, request, services, files, name, redirect)


def _file_answer(
    request: Request, services: Services, files: Sequence[JobFile], name: str, redirect: bool
) -> Response:
    file = _find_file(files, name)
    if file is None:
        raise NotFoundError(
            f"the job has no file '{name}'",
            remedy="'files' of its links lists those that there are",
        )
    led = lead_to_file(services.blobs, file) if redirect else None
    return led or send_file(request, services.blobs, file)


@router.head(
    "/jobs/{job_id}/files/{name:path}",
    response_class=Response,
    responses={**HEAD, **refusals(*EVERYWHERE, 404, 507)},
    summary="Whether a file is there",
)
async def head_file(
    job_id: str, name: str, request: Request, services: TheServices, caller: Reader
) -> Response:
    """As GET, without the bytes."""
    return await get_file(job_id, name, request, services, caller)


async def answer_with_result(
    request: Request, services: Services, caller: Caller, job: StoredJob, media_type: str
) -> Response:
    """The result of a job that has succeeded, as JSON or as a file."""
    files = await _files_with(services, job, FORMATS[job.kind].get(media_type))
    return await run_sync(_result_answer, request, services, caller, job, files, media_type)


async def _files_with(services: Services, job: StoredJob, name: str | None) -> Sequence[JobFile]:
    """The files of a job; one of that name is waited for, if it comes on demand."""
    files = await run_sync(services.jobs.files, job.id)
    if name is None or services.files is None or not can_be_made(job, names_of(files), name):
        return files
    # Others may wait for the same: who leaves must not cancel it.
    await asyncio.shield(asyncio.wrap_future(services.files.make(job, name)))
    return await run_sync(services.jobs.files, job.id)


def _result_answer(
    request: Request,
    services: Services,
    caller: Caller,
    job: StoredJob,
    files: Sequence[JobFile],
    media_type: str,
) -> Response:
    if media_type == JSON:
        report = read_report(services.blobs, files)
        result = Result.of(job_body(services, caller, job), report, files)
        answer = Response(result.model_dump_json(), media_type=JSON)
    else:
        name = FORMATS[job.kind][media_type]
        file = _find_file(files, name)
        if file is None:
            raise NotAcceptableError(
                f"this result has no '{name}'",
                remedy=f"accept {JSON}, which links to all that there is",
            )
        # By then another job may have the same address, so it has to be asked for each time.
        answer = send_file(request, services.blobs, file, cache="private, no-cache")
    answer.headers["Vary"] = "Accept, Prefer"
    return answer


def _find_file(files: Sequence[JobFile], name: str) -> JobFile | None:
    return next((file for file in files if file.name == name), None)


def read_report(blobs: BlobStore, files: Sequence[JobFile]) -> dict[str, Any] | None:
    """The report among the files of a job; None where its kind has none.  Call it in a thread."""
    return read_document(blobs, files, "report.json")


def read_document(blobs: BlobStore, files: Sequence[JobFile], name: str) -> dict[str, Any] | None:
    """The JSON object of a file of a job; None where there is no such.  Call it in a thread."""
    file = _find_file(files, name)
    if file is None:
        return None
    document: dict[str, Any] = json.loads(read_file(blobs, file))
    return document
