"""Which triangles keep to a room."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.room import Room
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.soup_views import all_contained


def are_inside(triangles: FloatArray, room: Room) -> BoolArray:
    """(m,) of a soup (m, 3, 3) in the place of the ``room``: what touches no voxel beyond it."""
    inside = np.empty(len(triangles), dtype=np.bool_)
    all_contained(np.ascontiguousarray(triangles), room.voxels, inside)
    return inside
