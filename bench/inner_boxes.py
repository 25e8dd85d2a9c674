"""Axis-aligned boxes inside of a mesh, the plainest of inner occluders.

Of all boxes of voxels that lie wholly inside the largest is taken, then the largest of what is
left, grown into what the ones before it have taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.compile import kernel

Faces = NDArray[np.int64]

TRIANGLES = 12  # of a box
_FACES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [1, 5, 7], [1, 7, 3], [0, 2, 6], [0, 6, 4],
], dtype=np.int64)  # corners numbered 4 x + 2 y + z  # fmt: skip


def inner_boxes(grid: VoxelGrid, count: int) -> tuple[FloatArray, Faces]:
    """The surfaces of at most ``count`` boxes of voxels that are inside, in the grid's world."""
    ends = placed_boxes(grid.inside, count)
    corner = np.arange(8)
    columns = [ends[:, (corner >> bit) & 1, axis] for axis, bit in enumerate((2, 1, 0))]
    points = grid.to_world(np.stack(columns, axis=-1).reshape(-1, 3).astype(np.float64))
    faces = _FACES[None] + 8 * np.arange(len(ends))[:, None, None]
    return points, faces.reshape(-1, 3)


def placed_boxes(inside: BoolArray, count: int) -> NDArray[np.int64]:
    """(n, 2, 3) first voxel and the one past the last of at most ``count`` boxes, n <= count."""
    left = np.array(inside, dtype=np.bool_)
    boxes = []
    for _ in range(count):
        box = largest_box(left)
        if (box[0] == box[1]).any():
            break
        _grow(box, inside)
        boxes.append(box)
        left[tuple(slice(*ends) for ends in box.T)] = False
    return np.array(boxes, dtype=np.int64).reshape(-1, 2, 3)


def largest_box(inside: BoolArray) -> NDArray[np.int64]:
    """(2, 3) first voxel and the one past the last of the largest box that is all inside.

    Empty, all zeros, where nothing is.
    """
    found = np.zeros((2, 3), dtype=np.int64)
    _search(np.ascontiguousarray(inside), found)
    return found


def _grow(box: NDArray[np.int64], inside: BoolArray) -> None:
    """Move its sides outwards, one after the other, for as long as it stays inside."""
    moved = True
    while moved:
        moved = False
        for axis in range(3):
            for end, step in ((0, -1), (1, 1)):
                slab = box.copy()
                slab[1 - end, axis] = box[end, axis]
                slab[end, axis] += step
                if not 0 <= slab[end, axis] <= inside.shape[axis]:
                    continue
                if inside[tuple(slice(*ends) for ends in slab.T)].all():
                    box[end, axis] += step
                    moved = True


@kernel
def _search(inside: BoolArray, found: NDArray[np.int64]) -> None:
    """For each range along x the largest rectangle of what is inside all along it, by the
    histogram of each of its rows."""
    nx, ny, nz = inside.shape
    best = 0
    common = np.empty((ny, nz), dtype=np.bool_)
    heights = np.empty(nz + 1, dtype=np.int64)
    starts = np.empty(nz + 1, dtype=np.int64)
    tops = np.empty(nz + 1, dtype=np.int64)
    for first in range(nx):
        common[:] = True
        for last in range(first, nx):
            cells = 0
            for y in range(ny):
                for z in range(nz):
                    common[y, z] &= inside[last, y, z]
                    cells += common[y, z]
            if cells * (nx - first) <= best:
                break
            length = last + 1 - first
            if cells * length <= best:
                continue
            heights[:] = 0
            for y in range(ny):
                waiting = 0
                for z in range(nz + 1):
                    if z < nz:
                        heights[z] = heights[z] + 1 if common[y, z] else 0
                    start = z
                    height = heights[z] if z < nz else 0
                    while waiting > 0 and tops[waiting - 1] >= height:
                        waiting -= 1
                        start = starts[waiting]
                        size = tops[waiting] * (z - start) * length
                        if size > best:
                            best = size
                            found[0, 0], found[1, 0] = first, last + 1
                            found[0, 1], found[1, 1] = y + 1 - tops[waiting], y + 1
                            found[0, 2], found[1, 2] = start, z
                    if z < nz:
                        starts[waiting], tops[waiting] = start, height
                        waiting += 1
