"""How far triangles reach out from the middle of their mesh; a few stray ones change nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FURTHEST = 2.0**24
"""Usual reaches.  A float32 that far out has no digit left for a length of the usual reach, so no
program that stores float32 can have meant such a triangle to be of the same mesh as the others."""


@dataclass(frozen=True, eq=False)
class Reach:
    """Distances are the largest along an axis, world units.

    ``middle``  (3,) the median of the vertices by axis.
    ``of``      (m,) from the middle to the furthest corner of each triangle; above 0 for one that
                has an area.
    """

    middle: NDArray[np.float64]
    of: NDArray[np.float64]

    @classmethod
    def measure(cls, vertices: NDArray[np.float64], faces: NDArray[np.signedinteger]) -> Reach:
        """``vertices`` (n, 3) finite, ``faces`` (m, 3), at least one of each."""
        middle = np.array([np.median(column) for column in vertices.T])
        away = _highest(np.abs(c - m) for c, m in zip(vertices.T, middle, strict=True))
        return cls(middle, _highest(away[corners] for corners in faces.T))

    @property
    def usual(self) -> float:
        """Half of the triangles reach no further."""
        half = (len(self.of) - 1) // 2
        return float(np.partition(self.of, half)[half])

    @property
    def stray(self) -> NDArray[np.bool_]:
        """(m,) the triangles, less than half of them, that reach beyond all sense."""
        return np.asarray(self.of > FURTHEST * self.usual)


def _highest(arrays: Iterator[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Element by element, in the first of the arrays; only two of them are held at a time."""
    most = next(arrays)
    for other in arrays:
        np.maximum(most, other, out=most)
    return most
