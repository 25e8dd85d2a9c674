"""A scene of many objects in, a tree of occluders out."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from service.jobs.job import JobKind
from service.routes.docs import RESULT_OR_JOB, upload_docs
from service.routes.services import KEYED, TheServices, Writer
from service.routes.submission import take_in
from service.uploads.receiving import Wanted

router = APIRouter(prefix="/v1", tags=["submit"], dependencies=KEYED)

_PARTS = (
    Wanted(
        "scene",
        (".glb", ".zip"),
        "A GLB, or a zip of a folder with a scene, with a file name.",
    ),
)
_SCENES = ("model/gltf-binary", "application/zip", "application/octet-stream")


@router.post(
    "/scenes",
    response_class=Response,
    responses=RESULT_OR_JOB,
    openapi_extra=upload_docs(JobKind.SCENE, _PARTS, _SCENES),
    summary="Make occluders of a scene",
)
async def make_scene(request: Request, services: TheServices, caller: Writer) -> Response:
    """A tree of occluders: one an object, and others above for what is far away."""
    return await take_in(request, services, caller, JobKind.SCENE, _PARTS)
