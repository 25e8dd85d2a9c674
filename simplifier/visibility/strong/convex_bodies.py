"""Convex bodies that hide what is behind them: by their planes, shrunk by a margin for rounding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.hull_rays import FLAT, SPHERE, VOLUME

MARGIN = 1e-9
"""Of the extent of a scene: bodies are smaller by so much, far more than rounding and nothing else.
What touches a body in a face alone is thus clear of it."""


@dataclass(frozen=True, eq=False)
class ConvexBodies:
    """``kinds``   (m,) uint8: VOLUME, FLAT or SPHERE of :mod:`simplifier.kernels.hull_rays`.
    ``starts``  (m + 1,) int64: where the planes of each begin in ``planes`` (p, 4) float64, rows
                n, d of unit normals, inside n x <= d; FLAT has its own plane first; the only row of
                a SPHERE is its centre and its radius.
    ``boxes``   (m, 2, 3) float64: what each lies in.
    """

    kinds: NDArray[np.uint8]
    starts: NDArray[np.int64]
    planes: FloatArray
    boxes: FloatArray

    def __len__(self) -> int:
        return len(self.kinds)

    @classmethod
    def of_boxes(cls, boxes: FloatArray, margin: float) -> ConvexBodies:
        """Boxes (m, 2, 3) along the axes."""
        count = len(boxes)
        planes = np.zeros((count, 6, 4))
        for axis in range(3):
            planes[:, axis, axis], planes[:, axis, 3] = -1.0, -boxes[:, 0, axis] - margin
            planes[:, 3 + axis, axis], planes[:, 3 + axis, 3] = 1.0, boxes[:, 1, axis] - margin
        return cls(
            np.full(count, VOLUME, np.uint8), 6 * np.arange(count + 1, dtype=np.int64),
            planes.reshape(-1, 4), np.array(boxes, dtype=np.float64),
        )  # fmt: skip

    @classmethod
    def of_volume(cls, planes: FloatArray, box: FloatArray, margin: float) -> ConvexBodies:
        """What is inside of all planes (p, 4) with unit normals, and in a box (2, 3)."""
        starts = np.array([0, len(planes)], dtype=np.int64)
        shrunk = planes - np.array([0.0, 0.0, 0.0, margin])
        return cls(np.array([VOLUME], np.uint8), starts, shrunk, np.array(box)[None])

    @classmethod
    def of_triangles(cls, corners: FloatArray, margin: float) -> ConvexBodies:
        """Triangles (m, 3, 3); those without an area hide nothing and are left out."""
        corners = np.asarray(corners, dtype=np.float64).reshape(-1, 3, 3)
        edges = np.roll(corners, -1, axis=1) - corners
        normals = np.cross(edges[:, 0], edges[:, 1])
        areas = np.linalg.norm(normals, axis=1)
        kept = areas > margin * np.linalg.norm(edges, axis=2).max(axis=1)
        corners, edges = corners[kept], edges[kept]
        normals = normals[kept] / areas[kept, None]
        outwards = np.cross(edges, normals[:, None])
        outwards /= np.linalg.norm(outwards, axis=2, keepdims=True)
        own = np.concatenate([normals, _dots(normals, corners[:, 0])[:, None]], axis=1)
        sides = np.concatenate([outwards, _dots(outwards, corners)[..., None] - margin], axis=2)
        count = len(corners)
        return cls(
            np.full(count, FLAT, np.uint8), 4 * np.arange(count + 1, dtype=np.int64),
            np.concatenate([own[:, None], sides], axis=1).reshape(-1, 4),
            np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1).reshape(-1, 2, 3),
        )  # fmt: skip

    @classmethod
    def of_spheres(cls, centres: FloatArray, radius: float, margin: float) -> ConvexBodies:
        """Spheres around centres (m, 3)."""
        count = len(centres)
        planes = np.column_stack([centres, np.full(count, radius - margin)])
        boxes = np.stack([centres - radius, centres + radius], axis=1)
        return cls(
            np.full(count, SPHERE, np.uint8), np.arange(count + 1, dtype=np.int64), planes, boxes
        )

    @classmethod
    def joined(cls, some: list[ConvexBodies]) -> ConvexBodies:
        """All bodies of several, in order."""
        counts = np.concatenate([[0], *(np.diff(one.starts) for one in some)])
        return cls(
            np.concatenate([np.empty(0, np.uint8), *(one.kinds for one in some)]),
            np.cumsum(counts).astype(np.int64),
            np.concatenate([np.empty((0, 4)), *(one.planes for one in some)]),
            np.concatenate([np.empty((0, 2, 3)), *(one.boxes for one in some)]),
        )


def _dots(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray((a * b).sum(axis=-1))
