"""The best so far of a running job, as a picture."""

from __future__ import annotations

import hashlib

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from service.errors import NotFoundError
from service.headers.ranges import is_fresh
from service.routes.callers import KEYED, Reader
from service.routes.docs import EVERYWHERE, binary, header, refusals
from service.routes.services import TheServices

_PNG = "image/png"
_HEADERS = {
    "ETag": header("The SHA-256 of the picture."),
    "Cache-Control": header("`no-store`: the next one is another."),
}

router = APIRouter(prefix="/v1", tags=["jobs"], dependencies=KEYED)


@router.get(
    "/jobs/{job_id}/picture",
    response_class=Response,
    responses={
        200: {"description": "The picture.", "headers": _HEADERS, "content": binary(_PNG)},
        304: {"description": "You have the latest one.", "headers": _HEADERS},
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
