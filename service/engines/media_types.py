"""What the files of a result are, by suffix."""

from __future__ import annotations

from pathlib import PurePosixPath

_MEDIA_TYPES = {
    ".glb": "model/gltf-binary",
    ".obj": "model/obj",
    ".ply": "model/ply",
    ".stl": "model/stl",
    ".off": "model/off",
    ".tres": "text/plain; charset=utf-8",
    ".json": "application/json",
    ".html": "text/html; charset=utf-8",
    ".png": "image/png",
    ".zip": "application/zip",
}


def media_type_of(name: str) -> str:
    """Of bytes that nobody should interpret, where the suffix is not known."""
    return _MEDIA_TYPES.get(PurePosixPath(name).suffix.lower(), "application/octet-stream")
