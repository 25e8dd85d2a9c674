"""Triangles that leave the solid are moved into it, as they are, as far as that goes."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.kernels.soup_views import all_contained
from simplifier.refinement.coarse import coarse

_STEPS = 48
_STEP = 0.25  # voxels


def sunk(vertices: FloatArray, faces: IntArray, allowed: BoolArray) -> FloatArray:
    """Vertices (n, 3) of the step at which most faces keep to ``allowed`` (nx, ny, nz) bool.

    In each of 48 steps the vertices of the faces that are outside go a quarter of a voxel to where
    the nearest voxel that is not allowed is further from the faces' centres.  A chord across a
    hollow sinks that way; shrinking it instead would open its neighbours.  The vertices are in the
    space of the array.
    """
    inside = np.zeros(len(faces), dtype=np.bool_)
    moved, best = vertices.copy(), vertices
    all_contained(moved[faces], allowed, inside)
    most = int(inside.sum())
    if most == len(faces):
        return best
    deeper = _Depth(allowed)
    for _ in range(_STEPS):
        outside = faces[~inside]
        ways = np.zeros_like(moved)
        for corner in range(3):
            np.add.at(ways, outside[:, corner], deeper.gradient(moved[outside].mean(axis=1)))
        lengths = np.linalg.norm(ways, axis=1, keepdims=True)
        moved += _STEP * np.divide(ways, lengths, out=np.zeros_like(ways), where=lengths > 0.0)
        all_contained(moved[faces], allowed, inside)
        if int(inside.sum()) > most:
            most, best = int(inside.sum()), moved.copy()
        if most == len(faces):
            break
    return best


class _Depth:
    """How far it is to the voxels that are not allowed, smoothed; it need not be exact."""

    def __init__(self, allowed: BoolArray) -> None:
        shares, self._size = coarse(allowed)
        depth = ndimage.distance_transform_edt(np.pad(shares, 1) > 0.5)[1:-1, 1:-1, 1:-1]
        self._depth = ndimage.gaussian_filter(depth, 1.0)

    def gradient(self, points: FloatArray) -> FloatArray:
        """(q, 3) by central differences, a cell to either side."""
        cells = points / self._size - 0.5
        columns = []
        for axis in range(3):
            ends = np.repeat(cells.T[None], 2, axis=0)
            ends[:, axis] += np.array([[-1.0], [1.0]])
            low, high = (
                ndimage.map_coordinates(self._depth, end, order=1, mode="nearest") for end in ends
            )
            columns.append(high - low)
        return np.stack(columns, axis=1)
