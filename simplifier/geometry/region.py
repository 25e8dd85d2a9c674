"""Region: a box in space, turned as one likes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_FACES = np.array([  # of the corners above, outwards by the right-hand rule
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
])  # fmt: skip


@dataclass(frozen=True, eq=False)
class Region:
    """``centre`` (3,), ``half`` (3,) of its edges, and ``axes`` (3, 3), rows: the edges' unit
    vectors, right-handed; world units.  A region is the open set: its surface is not part of it.
    """

    centre: FloatArray
    half: FloatArray
    axes: FloatArray

    @classmethod
    def of(cls, centre: FloatArray, size: FloatArray, rotation: FloatArray) -> Region:
        """``size`` (3,) of the edges, ``rotation`` (4,) a quaternion x y z w that is not zero."""
        x, y, z, w = rotation / np.linalg.norm(rotation)
        axes = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
            [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
            [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        return cls(centre, size / 2.0, axes)

    @property
    def triangles(self) -> FloatArray:
        """(12, 3, 3) its surface, wound outwards."""
        corners = (_CORNERS * self.half) @ self.axes + self.centre
        return np.asarray(corners[_FACES])

    def meets_boxes(self, centres: FloatArray, half: float) -> NDArray[np.bool_]:
        """(n,) which of the cubes (n, 3), ``half`` an edge's half, share a point with its closure.

        By the separating axes of two boxes: three of either, and their nine products.
        """
        axes = np.concatenate([np.eye(3), self.axes, _products(self.axes, np.eye(3))])
        reach = np.abs(axes @ self.axes.T) @ self.half + half * np.abs(axes).sum(axis=1)
        return np.asarray((np.abs((centres - self.centre) @ axes.T) <= reach).all(axis=1))

    def crossed_by(self, triangles: FloatArray, tolerance: float = 0.0) -> NDArray[np.bool_]:
        """(m,) which of the triangles (m, 3, 3) have a point inside, deeper than ``tolerance``.

        By the separating axes of a box and a triangle: three, the normal, and nine products.
        """
        half = np.maximum(self.half - tolerance, 0.0)
        inside = (triangles - self.centre) @ self.axes.T
        # The box's own axes first: they separate most.
        crossed = ((inside.min(axis=1) < half) & (inside.max(axis=1) > -half)).all(axis=1)
        crossed[crossed] = _not_apart(inside[crossed], half)
        return np.asarray(crossed)


def _not_apart(inside: FloatArray, half: FloatArray) -> NDArray[np.bool_]:
    """(m,) which of the triangles (m, 3, 3), in the box's own space, neither their normals nor the
    products of edges separate from it."""
    edges = np.roll(inside, -1, axis=1) - inside
    # (m, k, 3); where one vanishes, another separates as well.
    axes = np.concatenate(
        [
            np.cross(edges[:, :1], edges[:, 1:2]),
            *(np.cross(np.eye(3)[axis], edges) for axis in range(3)),
        ],
        axis=1,
    )
    seen = np.einsum("mki,mci->mkc", axes, inside)
    reach = np.abs(axes) @ half
    apart = (seen.min(axis=2) >= reach) | (seen.max(axis=2) <= -reach)
    return np.asarray(~(apart & (axes != 0.0).any(axis=2)).any(axis=1))


def _products(one: FloatArray, other: FloatArray) -> FloatArray:
    """(9, 3) of each axis of the one with each of the other."""
    return np.cross(one[:, None], other[None]).reshape(-1, 3)
