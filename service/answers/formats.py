"""Which of a result's files answers which ``Accept``."""

from __future__ import annotations

from collections.abc import Mapping

from service.errors import NotAcceptableError
from service.headers.accept import best_of
from service.jobs.job import JobKind

JSON = "application/json"
HTML = "text/html"

FORMATS: Mapping[JobKind, Mapping[str, str]] = {
    JobKind.OCCLUDER: {
        "model/gltf-binary": "occluder.glb",
        "application/x-occluder": "occluder.occ",
        "model/obj": "lod0.obj",
        "model/ply": "lod0.ply",
        "application/ply": "lod0.ply",
        "model/stl": "lod0.stl",
        "model/off": "lod0.off",
        "application/x-godot-resource": "lod0.tres",
        HTML: "report.html",
    },
    JobKind.EVALUATION: {HTML: "report.html"},
    JobKind.SCENE: {"application/zip": "scene.zip", "model/gltf-binary": "preview.glb"},
    JobKind.TRADEOFF: {
        HTML: "tradeoff.html",
        "text/csv": "tradeoff.csv",
        "image/png": "tradeoff.png",
    },
}
"""By kind of job and media type, the file; JSON comes before all of them.

A GLB and an OCC hold all levels of detail, the others the finest.
"""


def chosen_format(accept: str, kind: JobKind) -> str:
    """The media type to answer in.  Raises :class:`~service.errors.NotAcceptableError`."""
    offered = [JSON, *FORMATS[kind]]
    best = best_of(accept, offered)
    if best is None:
        raise NotAcceptableError(
            f"nothing can be given of '{accept}'", remedy=f"accept one of {', '.join(offered)}"
        )
    return best
