"""A mesh in, occluders out."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from service.jobs.job import JobKind
from service.routes.docs import RESULT_OR_JOB, upload_docs
from service.routes.services import KEYED, TheServices, Writer
from service.routes.submission import take_in
from service.uploads.overrides import OVERRIDES
from service.uploads.receiving import Wanted
from simplifier import MESH_SUFFIXES

router = APIRouter(prefix="/v1", tags=["submit"], dependencies=KEYED)

MESHES = (
    "model/gltf-binary", "model/gltf+json", "model/obj", "model/ply", "model/stl", "model/off",
    "application/octet-stream",
)  # fmt: skip
"""Media types of raw bodies; for the last, ``filename`` says the format."""

_PARTS = (Wanted("mesh", MESH_SUFFIXES, "The mesh, with a file name."), OVERRIDES)


@router.post(
    "/occluders",
    response_class=Response,
    responses=RESULT_OR_JOB,
    openapi_extra=upload_docs(JobKind.OCCLUDER, _PARTS, MESHES),
    summary="Make occluders of a mesh",
)
async def make_occluders(request: Request, services: TheServices, caller: Writer) -> Response:
    """Levels of detail, each judged for precision and recall.

    The body is the mesh, options are in the query; or a form with the parts `mesh` and `options`,
    and `overrides` where there are some.  The same files, options and version give the stored
    result at once.
    """
    return await take_in(request, services, caller, JobKind.OCCLUDER, _PARTS)
