"""The kinds of job that bring what they are about as an upload, each by the route that takes it in.

Whichever it is, it goes on as a :class:`~service.jobs.job.Submission` by
:meth:`Services.submit <service.routes.services.Services.submit>`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import Response

from service.errors import InvalidOverridesError
from service.jobs.job import JobKind
from service.routes.docs import RESULT_OR_JOB, upload_docs
from service.routes.services import KEYED, TheServices, Writer
from service.routes.submission import submit_upload
from service.uploads.receiving import Wanted
from simplifier import ELEVATION_SUFFIXES, MESH_SUFFIXES

router = APIRouter(prefix="/v1", tags=["submit"], dependencies=KEYED)

_MESH = Wanted("mesh", MESH_SUFFIXES, "The mesh, with a file name.")
_OVERRIDES = Wanted(
    "overrides",
    (".toml",),
    "Parts drawn by hand, regions to leave open and what to ignore of the mesh, as TOML; at most "
    "1 MiB.",
    needed=False,
    largest=1 << 20,  # a thousand times what people write
    fault=InvalidOverridesError,
)
PARTS: Mapping[JobKind, tuple[Wanted, ...]] = {
    JobKind.OCCLUDER: (_MESH, _OVERRIDES),
    JobKind.EVALUATION: (
        _MESH,
        Wanted("occluder", MESH_SUFFIXES, "What is to hide as much as the mesh, with a file name."),
        _OVERRIDES,
    ),
    JobKind.SCENE: (
        Wanted(
            "scene",
            (".glb", ".zip"),
            "A GLB, or a zip of a folder with a scene, with a file name.",
        ),
    ),
    JobKind.VISIBILITY: (
        Wanted(
            "scene",
            (".glb", ".zip", *ELEVATION_SUFFIXES),
            "A GLB, a zip of a folder with a scene, or an elevation model (an array of NumPy, or a "
            "GeoTIFF), with a file name.",
        ),
    ),
}
"""The files that an upload brings."""

RAW: Mapping[JobKind, tuple[str, ...]] = {
    JobKind.OCCLUDER: (
        "model/gltf-binary", "model/gltf+json", "model/obj", "model/ply", "model/stl", "model/off",
        "application/octet-stream",
    ),
    JobKind.SCENE: ("model/gltf-binary", "application/zip", "application/octet-stream"),
    JobKind.VISIBILITY: (
        "model/gltf-binary", "application/zip", "image/tiff", "application/octet-stream",
    ),
}  # fmt: skip
"""Media types of bodies that are the first file as it is; for the last, ``filename`` says the
format."""


def _upload_route(kind: JobKind) -> dict[str, Any]:
    """What a route that takes an upload says of its body and its answers."""
    return {
        "response_class": Response,
        "responses": RESULT_OR_JOB,
        "openapi_extra": upload_docs(kind, PARTS[kind], RAW.get(kind, ())),
    }


@router.post("/occluders", summary="Make occluders of a mesh", **_upload_route(JobKind.OCCLUDER))
async def make_occluders(request: Request, services: TheServices, caller: Writer) -> Response:
    """Levels of detail, each judged for precision and recall.

    The body is the mesh, options are in the query; or a form with the parts `mesh` and `options`,
    and `overrides` where there are some.  The same files, options and version give the stored
    result at once.
    """
    kind = JobKind.OCCLUDER
    return await submit_upload(request, services, caller, kind, PARTS[kind])


@router.post("/evaluations", summary="Judge an occluder", **_upload_route(JobKind.EVALUATION))
async def judge_occluder(request: Request, services: TheServices, caller: Writer) -> Response:
    """Precision and recall of any occluder against its mesh: a form with the two as parts,
    and `overrides` of the mesh where there are some.
    """
    kind = JobKind.EVALUATION
    return await submit_upload(request, services, caller, kind, PARTS[kind])


@router.post("/scenes", summary="Make occluders of a scene", **_upload_route(JobKind.SCENE))
async def make_scene(request: Request, services: TheServices, caller: Writer) -> Response:
    """A tree of occluders: one an object, and others above for what is far away."""
    kind = JobKind.SCENE
    return await submit_upload(request, services, caller, kind, PARTS[kind])


@router.post(
    "/visibility",
    summary="Find what is visible from view cells",
    **_upload_route(JobKind.VISIBILITY),
)
async def find_visible_sets(request: Request, services: TheServices, caller: Writer) -> Response:
    """For each view cell of a scene the objects of which anything may be seen from it.

    Results are the file `sets.pvs`, `report.json` and `cells.png`, a plan of the cells.
    """
    kind = JobKind.VISIBILITY
    return await submit_upload(request, services, caller, kind, PARTS[kind])
