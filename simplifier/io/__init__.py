"""Mesh and scene files in, occluder and scene files out.

One file a format, each a pair of plain functions on bytes; ``formats.py`` is the table from suffix
to codec.
"""

from simplifier.io.camera_path import load_camera_path, save_camera_path
from simplifier.io.formats import readable_suffixes, writable_suffixes
from simplifier.io.load import load_lods, load_mesh, load_occluder
from simplifier.io.save import check_writable, save_occluder
from simplifier.io.save_lods import save_lods
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
    "save_lods",
    "save_occluder",
    "writable_suffixes",
    "write_scene",
]
