"""Voxels -> the largest boxes that are inside.

Of all boxes of voxels that lie wholly inside the largest is taken, then the largest of what is
left, grown into what the ones before it have taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.solid import BoolArray
from simplifier.kernels.inner_boxes import search_largest_box


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
    search_largest_box(np.ascontiguousarray(inside), found)
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
