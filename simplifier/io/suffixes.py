"""Suffixes of the files that can be read and written, for those who only need to know that.

The codecs are in ``io/formats.py``, which takes long to import; a test holds the two together.

Where an asset's overrides are, for those who need not read them.
"""

from __future__ import annotations

from pathlib import Path

from simplifier.io.places import is_file

MESH_SUFFIXES = (".3mf", ".dae", ".glb", ".gltf", ".obj", ".occ", ".off", ".ply", ".stl", ".tres")
"""Files that a mesh is read from, with the dot, in lower case."""

OCCLUDER_SUFFIXES = (".glb", ".obj", ".occ", ".off", ".ply", ".stl", ".tres")
"""Files that an occluder is written to."""

QUAD_SUFFIXES = (".obj", ".off", ".ply")
"""Files that hold quads, too."""

ELEVATION_SUFFIXES = (".npy", ".tif", ".tiff")
"""Files that heights of a terrain are read from."""


SUFFIX = ".overrides.toml"
"""In place of the mesh's own."""


def overrides_place(mesh: Path) -> Path:
    """The file that belongs to a mesh, whether or not it is there."""
    return mesh.with_suffix(SUFFIX) if mesh.name else mesh / SUFFIX  # a folder may have no name


def overrides_beside(mesh: Path) -> Path | None:
    """The file that belongs to a mesh; None where there is none."""
    path = overrides_place(mesh)
    return path if is_file(path) else None
