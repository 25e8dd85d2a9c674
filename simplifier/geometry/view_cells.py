"""View cells: regions that a viewer may be in, of which each has a set of what is visible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

BOX, PRISM = 0, 1
"""Kinds of cell: a box along the axes, and a prism that stands on a triangle."""


@dataclass(frozen=True, eq=False)
class ViewCells:
    """Cells with z up, relative to an origin that whoever holds them knows; their order is theirs.

    Coordinates are float32 values, which files keep exactly: a set is right for the very cell that
    a reader finds.  Cells may touch and overlap.

    ``kinds``      (n,) uint8, :data:`BOX` or :data:`PRISM`.
    ``low``, ``high``  (n, 3) float64: the box around each.
    ``corners``    (n, 3, 2) float64: of a prism, counter-clockwise seen from above; zeros of a box.
    """

    kinds: NDArray[np.uint8]
    low: FloatArray
    high: FloatArray
    corners: FloatArray

    @classmethod
    def boxes(cls, low: FloatArray, high: FloatArray) -> ViewCells:
        """Boxes (n, 3), rounded to float32.  Raises :class:`OptionError` where one is empty."""
        low, high = _rounded(low), _rounded(high)
        _check_filled(low, high)
        return cls(np.full(len(low), BOX, np.uint8), low, high, np.zeros((len(low), 3, 2)))

    @classmethod
    def prisms(cls, corners: FloatArray, low: FloatArray, high: FloatArray) -> ViewCells:
        """Prisms on triangles (n, 3, 2) from height ``low`` (n,) to ``high`` (n,), rounded.

        Raises :class:`OptionError` where one is empty once it is rounded.
        """
        corners, low, high = _rounded(corners), _rounded(low), _rounded(high)
        area = signed_areas(corners)
        corners = np.where((area < 0.0)[:, None, None], corners[:, ::-1], corners)
        lows = np.column_stack([corners.min(axis=1), low])
        highs = np.column_stack([corners.max(axis=1), high])
        _check_filled(lows, np.where((area == 0.0)[:, None], lows, highs))
        return cls(np.full(len(low), PRISM, np.uint8), lows, highs, corners)

    @classmethod
    def joined(cls, *some: ViewCells) -> ViewCells:
        """All cells of several, in order."""
        return cls(
            *(
                np.concatenate([getattr(cells, name) for cells in some])
                for name in ("kinds", "low", "high", "corners")
            )
        )

    def __post_init__(self) -> None:
        for array in (self.kinds, self.low, self.high, self.corners):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.kinds)

    def some(self, chosen: NDArray[np.int64] | BoolArray) -> ViewCells:
        """Those of an index or a mask, in its order."""
        return ViewCells(
            self.kinds[chosen], self.low[chosen], self.high[chosen], self.corners[chosen]
        )

    def outline(self, cell: int) -> FloatArray:
        """(4, 2) or (3, 2) the corners of a cell's plan, counter-clockwise."""
        if self.kinds[cell] == PRISM:
            return np.asarray(self.corners[cell])
        (x0, y0), (x1, y1) = self.low[cell, :2], self.high[cell, :2]
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])

    def containing(self, point: FloatArray) -> NDArray[np.int64]:
        """The cells that hold a point (3,), borders included, ascending."""
        within = np.flatnonzero(((self.low <= point) & (point <= self.high)).all(axis=1))
        kept = [
            cell
            for cell in within
            if self.kinds[cell] == BOX or _left_of_all(self.corners[cell], point[:2])
        ]
        return np.array(kept, dtype=np.int64)


def signed_areas(corners: FloatArray) -> FloatArray:
    """(n,) of triangles (n, 3, 2); positive counter-clockwise."""
    (ux, uy), (vx, vy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return np.asarray(0.5 * (ux * vy - uy * vx))


def _left_of_all(corners: FloatArray, point: FloatArray) -> bool:
    along = np.roll(corners, -1, axis=0) - corners
    to = point - corners
    # Two products, not their difference: no compiler of another reader fuses a comparison.
    return bool((along[:, 0] * to[:, 1] >= along[:, 1] * to[:, 0]).all())


def _rounded(values: FloatArray) -> FloatArray:
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def _check_filled(low: FloatArray, high: FloatArray) -> None:
    empty = np.flatnonzero(~((low < high).all(axis=1) & np.isfinite(low + high).all(axis=1)))
    if len(empty):
        raise OptionError(
            f"cell {empty[0]} holds nothing: it reaches from {low[empty[0]].tolist()}"
            f" to {high[empty[0]].tolist()}",
            where="cells",
            remedy="give each a low corner that is below its high one along every axis",
        )
