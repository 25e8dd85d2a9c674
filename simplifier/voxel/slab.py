"""TriangleMesh -> the slab that it lies in, where that is thin: two planes that it keeps between.

What leaves a slab only sticks out.  From most sides that is next to nothing, and a search in a few
hundred views takes no notice; on edge it is several times all there is to see.
"""

from __future__ import annotations

import math

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.room import EVERYWHERE
from simplifier.geometry.solid import VoxelGrid

_THICK = 8.0  # cells: beside more, what a triangle in the room can stick out by is little
_SHARE = 0.125  # and of the longest side, at most
_FACES = 1024  # by which the direction is found: what is flat on both sides shows it in any
_BLOCK = 65_536  # vertices at a time, so that a fine mesh takes no memory
_DIGITS = 6  # of the direction: the order of sums must not show


def thin_slab(mesh: TriangleMesh, grid: VoxelGrid, margin: float) -> FloatArray:
    """(5,) as :attr:`~simplifier.geometry.room.Room.slab` has it, for a room with that ``margin``;
    :data:`~simplifier.geometry.room.EVERYWHERE` where it would be thick."""
    most = min(_THICK, _SHARE * max(grid.shape))
    few = mesh.faces[:: math.ceil(len(mesh.faces) / _FACES)]
    corners = grid.to_grid(mesh.vertices[few])
    normal = _main_normal(corners)
    if normal is None or np.ptp(corners @ normal) > most:
        return EVERYWHERE
    low, high = np.inf, -np.inf
    for begin in range(0, len(mesh.vertices), _BLOCK):
        along = grid.to_grid(mesh.vertices[begin : begin + _BLOCK]) @ normal
        low, high = min(low, along.min()), max(high, along.max())
    if high - low > most:
        return EVERYWHERE
    before = margin * normal.sum()
    return np.array([*normal, low + before, high + before])


def _main_normal(triangles: FloatArray) -> FloatArray | None:
    """The unit vector that normals of triangles (m, 3, 3) lie along most, by area; None without
    any.  Those of edges that stand square to two flat sides do not turn it."""
    p, q, r = np.moveaxis(triangles, 1, 0)
    across = np.cross(q - p, r - p)
    areas = np.linalg.norm(across, axis=1)
    there = areas > 0.0
    if not there.any():
        return None
    weighted = across[there] / np.sqrt(areas[there])[:, None]
    normal = np.round(np.linalg.eigh(weighted.T @ weighted)[1][:, -1], _DIGITS)
    normal *= np.sign(normal[np.flatnonzero(normal)[0]])
    return np.asarray(normal / np.linalg.norm(normal))
