"""How far a job is: server-sent events as it goes on, and a picture of the best so far."""

from __future__ import annotations

import hashlib
from collections.abc import AsyncIterator
from contextlib import aclosing, suppress

from anyio.to_thread import run_sync
from fastapi import APIRouter, Query, Request
from fastapi.responses import Response, StreamingResponse
from pydantic import BaseModel

from service.access.key import Caller
from service.answers.following import news
from service.errors import NotFoundError
from service.headers import is_fresh
from service.jobs.job import Job
from service.routes.docs import EVERYWHERE, binary, header, refusals
from service.routes.jobs import job_body
from service.routes.services import KEYED, Reader, Services, TheServices
from service.schemas.job import ProgressBody

_QUIET = 15.0  # seconds, after which a comment keeps proxies from hanging up

_EVENT = {
    "description": "One event.",
    "type": "object",
    "required": ["event", "data"],
    "properties": {
        "event": {"enum": ["state", "progress"]},
        "data": {"type": "string", "contentMediaType": "application/json"},
    },
}

router = APIRouter(prefix="/v1", tags=["jobs"], dependencies=KEYED)

_PNG = "image/png"
_PICTURE_HEADERS = {
    "ETag": header("The SHA-256 of the picture."),
    "Cache-Control": header("`no-store`: the next one is another."),
}


@router.get(
    "/jobs/{job_id}/events",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Events `state`, whose data is a Job, and `progress`, whose data is a "
            "Progress. The present state comes first; the stream ends after the last one.",
            "content": {"text/event-stream": {"schema": _EVENT}},
        },
        **refusals(*EVERYWHERE, 404),
    },
    summary="Follow a job",
)
async def job_events(
    job_id: str, request: Request, services: TheServices, caller: Reader
) -> StreamingResponse:
    """Server-sent events until the job has ended."""
    job = await run_sync(services.jobs.job, caller.tenant, job_id)
    return StreamingResponse(
        _stream(request, services, caller, job),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
    )


async def _stream(
    request: Request, services: Services, caller: Caller, job: Job
) -> AsyncIterator[bytes]:
    # NotFoundError: the job was removed with its asset, and there is no more to tell.
    with suppress(NotFoundError):
        async with aclosing(news(services.jobs, services.board, job, _QUIET)) as told:
            async for one in told:
                if await request.is_disconnected():
                    return
                if one is None:
                    yield b": still here\n\n"
                elif isinstance(one, Job):
                    yield _event("state", job_body(services, caller, one))
                else:
                    yield _event("progress", ProgressBody.of(job.id, one))


def _event(name: str, data: BaseModel) -> bytes:
    return f"event: {name}\ndata: {data.model_dump_json()}\n\n".encode()


@router.get(
    "/jobs/{job_id}/picture",
    response_class=Response,
    responses={
        200: {"description": "The picture.", "headers": _PICTURE_HEADERS, "content": binary(_PNG)},
        304: {"description": "You have the latest one.", "headers": _PICTURE_HEADERS},
        **refusals(*EVERYWHERE, 404),
    },
    summary="The best so far",
)
def job_picture(
    job_id: str,
    request: Request,
    services: TheServices,
    caller: Reader,
    n: int | None = Query(
        None, description="Number of the picture; the latest is given whatever it is."
    ),
) -> Response:
    """The best occluder so far over the original: yellow hides rightly, black is missed, blue hides
    wrongly. There is one about each second while a job refines, and none once it has ended."""
    job = services.jobs.job(caller.tenant, job_id)
    progress = services.board.latest(job.id)
    if progress is None or progress.picture is None:
        raise NotFoundError(
            "the job has no picture of a best so far",
            remedy="ask while it refines; when it has ended, 'files' of its links has pictures",
        )
    png = progress.picture.png
    etag = f'"{hashlib.sha256(png).hexdigest()}"'
    headers = {"ETag": etag, "Cache-Control": "no-store"}
    if is_fresh(request.headers, etag):
        return Response(status_code=304, headers=headers)
    return Response(png, headers=headers, media_type=_PNG)
