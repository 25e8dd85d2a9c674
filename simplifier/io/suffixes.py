"""Suffixes of the files that can be read and written, for those who only need to know that.

The codecs are in ``io/formats.py``, which takes long to import; a test holds the two together.
"""

from __future__ import annotations

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".occ", ".off", ".ply", ".stl", ".tres")
"""Files that a mesh is read from, with the dot, in lower case."""

OCCLUDER_SUFFIXES = (".glb", ".obj", ".occ", ".off", ".ply", ".stl", ".tres")
"""Files that an occluder is written to."""

QUAD_SUFFIXES = (".obj", ".off", ".ply")
"""Files that hold quads, too."""
