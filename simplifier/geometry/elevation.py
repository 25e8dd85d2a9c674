"""Elevation: heights of a terrain at the posts of a regular grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.errors import EmptyMeshError, UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

MOST_HEIGHT = 1e30
"""World units; further from 0 no raster of float32 has them."""


@dataclass(frozen=True, eq=False)
class Elevation:
    """Posts of a terrain in a world whose x is east, y north and z up.

    ``heights``  (ny, nx) float64, rows from north to south, columns from west to east; NaN where a
                 sample is missing.
    ``spacing``  between neighbouring posts along x and y, world units.
    ``origin``   x and y of the first post, the north-west one.

    Raises :class:`UnreadableMeshError` for heights that are infinite or beyond all sense, and for
    less than 2 x 2 posts; :class:`EmptyMeshError` where no four neighbours are known.  ``where``
    and advice are the caller's to add.
    """

    heights: FloatArray
    spacing: tuple[float, float]
    origin: tuple[float, float]

    def __post_init__(self) -> None:
        if self.heights.ndim != 2 or min(self.heights.shape) < 2:
            shape = " x ".join(map(str, self.heights.shape)) or "no"
            raise UnreadableMeshError(
                f"it has {shape} posts", remedy="give rows and columns of posts, two or more each"
            )
        known = np.isfinite(self.heights)
        if not (np.abs(self.heights, where=known, out=np.zeros(known.shape)) < MOST_HEIGHT).all():
            raise UnreadableMeshError(
                f"it has heights of {MOST_HEIGHT:g} or more",
                remedy="name the value that stands for missing samples, or repair them",
            )
        infinite = int(np.isinf(self.heights).sum())
        if infinite:
            noun = "height is" if infinite == 1 else "heights are"
            raise UnreadableMeshError(
                f"{infinite:,} {noun} infinite", remedy="write NaN where a sample is missing"
            )
        if not self.squares.any():
            raise EmptyMeshError(
                "no four neighbouring posts are known", remedy="fill the missing samples"
            )
        self.heights.setflags(write=False)

    @property
    def missing(self) -> int:
        """How many samples are."""
        return int(np.isnan(self.heights).sum())

    @property
    def squares(self) -> BoolArray:
        """(ny - 1, nx - 1) whether all four posts are known, so that there is a surface."""
        known = ~np.isnan(self.heights)
        return np.asarray(known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:])
