"""Which triangles keep to a room, and to which."""

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


def narrowest_room(triangles: FloatArray, room: Room, widest: int) -> Room:
    """The narrowest that a soup (m, 3, 3) keeps to, of the layers of ``room`` or more.

    ``widest``  layers that it is known to keep to.
    """
    narrower = map(room.up_to, range(room.limit, widest))
    return next((one for one in narrower if are_inside(triangles, one).all()), room.up_to(widest))
