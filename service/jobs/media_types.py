"""The table from suffix to media type, and back."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import PurePosixPath

_MEDIA_TYPES: Mapping[str, tuple[str, ...]] = {
    ".3mf": ("model/3mf", "application/vnd.ms-package.3dmanufacturing-3dmodel+xml"),
    ".csv": ("text/csv; charset=utf-8", "text/csv"),
    ".dae": ("model/vnd.collada+xml",),
    ".glb": ("model/gltf-binary",),
    ".gltf": ("model/gltf+json",),
    ".html": ("text/html; charset=utf-8",),
    ".json": ("application/json",),
    ".npz": ("application/x-npz",),
    ".obj": ("model/obj",),
    ".occ": ("application/x-occluder",),
    ".occs": ("application/x-occluder-scene",),
    ".off": ("model/off",),
    ".ply": ("model/ply", "application/ply", "application/x-ply"),
    ".png": ("image/png",),
    ".pvs": ("application/x-pvs",),
    ".stl": ("model/stl", "application/sla", "application/vnd.ms-pki.stl"),
    ".tif": ("image/tiff",),
    ".tiff": ("image/tiff",),
    ".toml": ("application/toml",),
    ".tres": ("application/x-godot-resource",),
    ".walk": ("application/x-occluder-walk",),
    ".zip": ("application/zip", "application/x-zip-compressed"),
}
"""What files of a suffix are called by others; by us as the first says."""


def media_type_of(name: str) -> str:
    """The media type by a file's suffix; plain bytes where the suffix is not known."""
    return _MEDIA_TYPES.get(PurePosixPath(name).suffix.lower(), ("application/octet-stream",))[0]


def suffix_of(media_type: str, suffixes: Collection[str]) -> str | None:
    """The one of these suffixes that a media type stands for, whatever its parameters."""
    plain = media_type.partition(";")[0].strip().lower()
    return next((one for one in suffixes if plain in _MEDIA_TYPES.get(one, ())), None)
