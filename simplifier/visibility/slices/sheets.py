"""Triangles -> Sheets: what hides although it is in no slice, being open, and curved or slanted.

Slices hide what is flat across an axis or closed.  A tunnel is neither: one sheet, open at its
ends, with walls in all directions.  The kernel looks at its triangles themselves, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.visibility.slices.box_tree import tree_over

_BORDER = -1


@dataclass(frozen=True, eq=False)
class Sheets:
    """Triangles, in a tree of boxes; arrays as :func:`~simplifier.kernels.sheets.close` takes them.

    There may be none of them.
    """

    points: FloatArray
    faces: IntArray
    normals: FloatArray
    beside: IntArray
    boxes: FloatArray
    children: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.faces)

    @classmethod
    def of(cls, points: FloatArray, faces: IntArray) -> Sheets:
        """``points`` (n, 3) voxels; ``faces`` (m, 3).  Corners are the same if all digits are.

        Triangles without an area are left out, and of several with the same corners all but one.
        """
        welded, place = np.unique(points, axis=0, return_inverse=True)
        corners = place.reshape(-1)[faces].astype(np.int32)
        _, first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)
        corners = corners[np.sort(first)]
        a, b, c = (welded[corners[:, corner]] for corner in range(3))
        across = np.cross(b - a, c - a)
        lengths = np.linalg.norm(across, axis=1)
        kept = lengths > 0.0
        corners, across = corners[kept], across[kept] / lengths[kept][:, None]
        at = welded[corners]
        boxes, children, order = tree_over(at.min(axis=1), at.max(axis=1))
        corners = np.ascontiguousarray(corners[order])
        return cls(
            np.ascontiguousarray(welded), corners, np.ascontiguousarray(across[order]),
            _beside(corners, len(welded)), boxes, children,
        )  # fmt: skip


def _beside(faces: IntArray, count: int) -> IntArray:
    """(m, 3) the triangle across each edge; those of an edge are paired, one may be left."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    ends.sort(axis=1)
    keys = ends[:, 0] * count + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    _, first, times = np.unique(keys[order], return_index=True, return_counts=True)
    rank = np.arange(len(keys)) - np.repeat(first, times)
    partner = rank ^ 1
    paired = partner < np.repeat(times, times)
    beside = np.full(len(keys), _BORDER, dtype=np.int32)
    other = order[np.where(paired, np.arange(len(keys)) - rank + partner, 0)]
    beside[order[paired]] = (other // 3)[paired]
    return np.ascontiguousarray(beside.reshape(-1, 3))
