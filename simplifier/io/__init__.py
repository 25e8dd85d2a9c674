"""Mesh and scene files in, occluder and scene files out.

One file a format, each a pair of plain functions on bytes; ``formats.py`` is the table from suffix
to codec.  Names are imported when they are first used: what only reads text or writes whole files
stays without numpy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simplifier.io.camera_path import load_camera_path, save_camera_path
    from simplifier.io.formats import readable_suffixes, writable_suffixes
    from simplifier.io.load import load_lods, load_mesh, load_occluder
    from simplifier.io.save import check_writable, save_occluder
    from simplifier.io.scene import load_scene
    from simplifier.io.scene_writer import write_scene

__all__ = [
    "check_writable",
    "load_camera_path",
    "load_lods",
    "load_mesh",
    "load_occluder",
    "load_scene",
    "readable_suffixes",
    "save_camera_path",
    "save_occluder",
    "writable_suffixes",
    "write_scene",
]

_PLACES = {
    "check_writable": "save",
    "load_camera_path": "camera_path",
    "load_lods": "load",
    "load_mesh": "load",
    "load_occluder": "load",
    "load_scene": "scene",
    "readable_suffixes": "formats",
    "save_camera_path": "camera_path",
    "save_occluder": "save",
    "writable_suffixes": "formats",
    "write_scene": "scene_writer",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = value  # asked for once
    return value
