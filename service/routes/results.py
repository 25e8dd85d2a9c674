"""What jobs have made: the result as a whole, and each file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from service.answers.files import send_file
from service.answers.formats import FORMATS, JSON, chosen_format
from service.errors import ConflictError, NotAcceptableError, NotFoundError
from service.jobs.job import Job as StoredJob
from service.jobs.job import JobFile, JobState
from service.routes.callers import KEYED, Reader
from service.routes.jobs import shown
from service.routes.services import Services, TheServices
from service.schemas.job import Failure
from service.schemas.openapi import EVERYWHERE, anything, binary, header, json_of, refusals
from service.schemas.result import FilePage, Result, ResultFile

router = APIRouter(prefix="/v1", tags=["results"], dependencies=KEYED)

_FILE_HEADERS = {
    "ETag": header("The SHA-256 of the whole file."),
    "Accept-Ranges": header("`bytes`."),
    "Cache-Control": header("A file of a job never changes."),
}
_FRESH = {"description": "You have these bytes already.", "headers": _FILE_HEADERS}
_PART = {
    "description": "The part that `Range` asks for.",
    "headers": {**_FILE_HEADERS, "Content-Range": header("Which part of how much.")},
    "content": anything(),
}

# Range and If-Range are described in words: checkers of this document take every answer that says
# application/json for a whole JSON text, which a part is not.
_ASKED: dict[str, Any] = {
    "parameters": [
        {
            "name": "If-None-Match",
            "in": "header",
            "description": "ETags that you have: 304 where the file is one of them.",
            "schema": {"type": "string"},
        }
    ]
}

ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The result, or the file that `Accept` asks for: GLB with all levels of "
        "detail, the other formats with the finest.",
        "content": {
            **json_of("Result"),
            **binary(*dict.fromkeys(kind for by_kind in FORMATS.values() for kind in by_kind)),
        },
        "headers": {
            "Vary": header("`Accept` among others."),
            "ETag": header("The SHA-256, for a file."),
        },
    }
}
"""How a result is sent, as OpenAPI has it."""


@router.get(
    "/jobs/{job_id}/result",
    response_class=Response,
    responses={**ANSWERS, 206: _PART, 304: _FRESH, **refusals(*EVERYWHERE, 404, 406, 409, 416)},
    openapi_extra=_ASKED,
    summary="What a job has made",
)
def get_result(job_id: str, request: Request, services: TheServices, caller: Reader) -> Response:
    """The report with links to all files; or one file, where `Accept` asks for its format."""
    job = services.jobs.job(caller.tenant, job_id)
    media_type = chosen_format(request.headers.get("accept", ""), job.kind)
    if job.state is not JobState.SUCCEEDED:
        raise _no_result(job)
    return result_answer(request, services, job, media_type)


@router.get(
    "/jobs/{job_id}/files", responses=refusals(*EVERYWHERE, 404), summary="List a job's files"
)
def list_files(job_id: str, services: TheServices, caller: Reader) -> FilePage:
    """What was sent, and what was made of it, by name."""
    job = services.jobs.job(caller.tenant, job_id)
    return FilePage(items=[ResultFile.of(job.id, file) for file in services.jobs.files(job.id)])


_FILE_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {"description": "Its bytes.", "headers": _FILE_HEADERS, "content": anything()},
    206: _PART,
    304: _FRESH,
    **refusals(*EVERYWHERE, 404, 416),
}


@router.get(
    "/jobs/{job_id}/files/{name:path}",
    response_class=Response,
    responses=_FILE_RESPONSES,
    openapi_extra=_ASKED,
    summary="A file of a job",
)
def get_file(
    job_id: str, name: str, request: Request, services: TheServices, caller: Reader
) -> Response:
    """Its bytes, whole or, by `Range` and `If-Range`, in part. It never changes; its ETag is the
    SHA-256 of it."""
    job = services.jobs.job(caller.tenant, job_id)
    return send_file(request, services.blobs, _file(services.jobs.files(job.id), name))


@router.head(
    "/jobs/{job_id}/files/{name:path}",
    response_class=Response,
    responses={
        200: {"description": "It is there.", "headers": _FILE_HEADERS},
        304: _FRESH,
        **refusals(*EVERYWHERE, 404),
    },
    summary="Whether a file is there",
)
def head_file(
    job_id: str, name: str, request: Request, services: TheServices, caller: Reader
) -> Response:
    """As GET, without the bytes."""
    return get_file(job_id, name, request, services, caller)


def result_answer(
    request: Request, services: Services, job: StoredJob, media_type: str
) -> Response:
    """The result of a job that has succeeded, as JSON or as a file.  Call it in a thread."""
    files = services.jobs.files(job.id)
    if media_type == JSON:
        result = Result.of(shown(services, job), _report(services, files), files)
        answer = Response(result.model_dump_json(), media_type=JSON)
    else:
        # By then another job may have the same address, so it has to be asked for each time.
        file = _offered(files, FORMATS[job.kind][media_type])
        answer = send_file(request, services.blobs, file, cache="private, no-cache")
    answer.headers["Vary"] = "Accept, Prefer"
    return answer


def _offered(files: Sequence[JobFile], name: str) -> JobFile:
    for file in files:
        if file.name == name:
            return file
    raise NotAcceptableError(
        f"this result has no '{name}'", remedy=f"accept {JSON}, which links to all that there is"
    )


def _file(files: Sequence[JobFile], name: str) -> JobFile:
    for file in files:
        if file.name == name:
            return file
    raise NotFoundError(
        f"the job has no file '{name}'", remedy="'files' of its links lists those that there are"
    )


def _report(services: Services, files: Sequence[JobFile]) -> dict[str, Any] | None:
    file = next((one for one in files if one.name == "report.json"), None)
    if file is None:
        return None
    try:
        with services.blobs.open(file.blob) as source:
            report: dict[str, Any] = json.load(source)
    except KeyError:
        raise NotFoundError("the report is stored no more", remedy="make a new job") from None
    return report


def _no_result(job: StoredJob) -> ConflictError:
    extra: dict[str, Any] = {"job": f"/v1/jobs/{job.id}"}
    if job.failure:
        extra["failure"] = Failure.model_validate(job.failure, from_attributes=True).model_dump()
        return ConflictError(
            f"the job has failed: {job.failure.detail}", remedy=job.failure.remedy, extra=extra
        )
    remedy = "POST to its 'retry'" if job.state.ended else "follow its 'events', or ask again later"
    return ConflictError(f"the job is {job.state}", remedy=remedy, extra=extra)
