"""TriangleMesh -> the slab that it lies in, where that is thin: two planes that it keeps between.

What leaves a slab only sticks out.  From most sides that is next to nothing, and a search in a few
hundred views takes no notice; on edge it is several times all there is to see.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.room import EVERYWHERE
from simplifier.geometry.solid import VoxelGrid
from simplifier.options.stages import TOUCHED_VOXELS

_THICK = 8.0  # cells: beside more, what a triangle in the room can stick out by is little
_SHARE = 0.125  # and of the longest side, at most
_FACES = 1024  # by which the direction is found: what is flat on both sides shows it in any
_BLOCK = 65_536  # vertices or faces at a time, so that a fine mesh takes no memory
_MISSED = 0.5  # of the box's largest side: what shows less of it may have missed most of the mesh
_FLAT = 0.001  # cells
_LEFT_OUT = 0.005  # of the surface, above and below: what a ground carries, if it is little
_FAR_LESS = 0.25  # of the height of all
_BINS = 4096  # of that height, in which surface is counted
_DIGITS = 6  # of the direction: the order of sums must not show


def thin_slab(mesh: TriangleMesh, grid: VoxelGrid, margin: float) -> FloatArray:
    """(5,) as :attr:`~simplifier.geometry.room.Room.slab` has it, for a room with that ``margin``;
    :data:`~simplifier.geometry.room.EVERYWHERE` where it would be thick.

    What a flat ground carries may stand out of it, where that is little and no voxel shows it.
    """
    most = min(_THICK, _SHARE * max(grid.shape))
    normal = _main_normal(mesh, grid, most)
    if normal is None:
        return EVERYWHERE
    low, high = _span(mesh, grid, normal)
    if high - low > most:
        return EVERYWHERE
    if _FLAT < high - low < TOUCHED_VOXELS:
        low, high = _bulk(mesh, grid, normal, low, high)
    before = margin * normal.sum()
    return np.array([*normal, low + before, high + before])


def _span(mesh: TriangleMesh, grid: VoxelGrid, normal: FloatArray) -> tuple[float, float]:
    """From where to where a mesh reaches along a direction of the grid."""
    low, high = np.inf, -np.inf
    for begin in range(0, len(mesh.vertices), _BLOCK):
        along = grid.to_grid(mesh.vertices[begin : begin + _BLOCK]) @ normal
        low, high = min(low, along.min()), max(high, along.max())
    return low, high


def _bulk(
    mesh: TriangleMesh, grid: VoxelGrid, normal: FloatArray, low: float, high: float
) -> tuple[float, float]:
    """The same of nearly all of its surface, where that is far less; else ``low`` and ``high``."""
    scale = _BINS / (high - low)
    begins, ends = np.zeros((2, _BINS))
    for triangles in _triangles(mesh, grid):
        _, areas = _normals(triangles)
        heights = triangles @ normal
        for found, extreme in ((begins, heights.min(axis=1)), (ends, heights.max(axis=1))):
            places = np.clip((extreme - low) * scale, 0.0, _BINS - 1.0).astype(np.int64)
            found += np.bincount(places, areas, _BINS)
    left_out = _LEFT_OUT * begins.sum()
    first = int(np.searchsorted(np.cumsum(begins), left_out, side="right"))
    after = _BINS - int(np.searchsorted(np.cumsum(ends[::-1]), left_out, side="right"))
    if after - first >= _FAR_LESS * _BINS:
        return low, high
    return low + first / scale, low + after / scale


def _main_normal(mesh: TriangleMesh, grid: VoxelGrid, most: float) -> FloatArray | None:
    """The unit vector that normals of triangles lie along most, by area; None without any, and
    where the mesh is thicker than ``most`` that way."""
    every = math.ceil(len(mesh.faces) / _FACES)
    some = grid.to_grid(mesh.vertices[mesh.faces[::every]])
    facing, area = _facing(some)
    least, *footprint = np.sort(mesh.extent) / grid.cell_size
    if every > 1 and least <= most and every * area < _MISSED * math.prod(footprint):
        # Few faces are most of the surface, as the ground that a town stands on.
        facing = np.sum([_facing(one)[0] for one in _triangles(mesh, grid)], axis=0)
    if not facing.any():
        return None
    normal = np.round(np.linalg.eigh(facing)[1][:, -1], _DIGITS)
    normal *= np.sign(normal[np.flatnonzero(normal)[0]])
    normal /= np.linalg.norm(normal)
    return None if np.ptp(some @ normal) > most else np.asarray(normal)


def _triangles(mesh: TriangleMesh, grid: VoxelGrid) -> Iterator[FloatArray]:
    """(m, 3, 3) corners of all, some at a time."""
    for begin in range(0, len(mesh.faces), _BLOCK):
        yield grid.to_grid(mesh.vertices[mesh.faces[begin : begin + _BLOCK]])


def _facing(triangles: FloatArray) -> tuple[FloatArray, float]:
    """(3, 3) the sum of what normals of triangles (m, 3, 3) lie along, by area, and the area.

    Those of edges that stand square to two flat sides turn none of its axes.
    """
    across, areas = _normals(triangles)
    there = areas > 0.0
    weighted = across[there] / np.sqrt(areas[there])[:, None]
    return weighted.T @ weighted, float(areas.sum()) / 2.0


def _normals(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m, 3) of triangles (m, 3, 3), as long as (m,) twice their areas."""
    p, q, r = np.moveaxis(triangles, 1, 0)
    across = np.cross(q - p, r - p)
    return across, np.linalg.norm(across, axis=1)
