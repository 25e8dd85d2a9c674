"""An occluder made elsewhere, judged."""

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

_PARTS = (
    Wanted("mesh", MESH_SUFFIXES, "The mesh, with a file name."),
    Wanted("occluder", MESH_SUFFIXES, "What is to hide as much as the mesh, with a file name."),
    OVERRIDES,
)


@router.post(
    "/evaluations",
    response_class=Response,
    responses=RESULT_OR_JOB,
    openapi_extra=upload_docs(JobKind.EVALUATION, _PARTS),
    summary="Judge an occluder",
)
async def judge_occluder(request: Request, services: TheServices, caller: Writer) -> Response:
    """Precision and recall of any occluder against its mesh: a form with the two as parts,
    and `overrides` of the mesh where there are some.
    """
    return await take_in(request, services, caller, JobKind.EVALUATION, _PARTS)
