"""Heights of shrunk occluders over pixels -> the edges that cast their shadows.

Wonka et al. (2000), section 5: occluders are given to the graphics hardware as edges in 2.5D.  Here
an edge is where a column of the raster stands beside a lower one; columns of one height that
stand in a row have one edge together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray


@dataclass(frozen=True, eq=False)
class ShadowEdges:
    """Upper edges of columns, along an axis each.

    ``ends``     (n, 4) int32: x and y of the first end and of the last, in corners of pixels.
    ``heights``  (n,) float32.
    ``sides``    (n,) int8: 1 where the solid is towards higher x or y, -1 where towards lower.
    ``judged``   (n,) bool: beside a pixel of the umbra that edges in it were left out by.
    """

    ends: NDArray[np.int32]
    heights: NDArray[np.float32]
    sides: NDArray[np.int8]
    judged: BoolArray

    def __len__(self) -> int:
        return len(self.ends)

    def some(self, chosen: BoolArray) -> ShadowEdges:
        """Those of a mask."""
        return ShadowEdges(
            self.ends[chosen], self.heights[chosen], self.sides[chosen], self.judged[chosen]
        )

    @property
    def boxes(self) -> FloatArray:
        """(n, 2, 2) float64: low and high corner in plan."""
        return np.sort(self.ends.reshape(-1, 2, 2), axis=1).astype(np.float64)


def shadow_edges(solid: NDArray[np.float32], umbra: FloatArray | None = None) -> ShadowEdges:
    """The edges of columns (nx, ny) up to ``solid``, minus infinite where there is none.

    ``umbra`` (nx, ny) heights that are known to be hidden, NaN where none is: edges are left out
    where the lower pixel beside them is hidden up to their height.
    """
    along_y = _edges(solid, umbra)
    along_x = _edges(solid.T, None if umbra is None else umbra.T)
    return ShadowEdges(
        np.concatenate([along_y.ends, along_x.ends[:, [1, 0, 3, 2]]]),
        np.concatenate([along_y.heights, along_x.heights]),
        np.concatenate([along_y.sides, along_x.sides]),
        np.concatenate([along_y.judged, along_x.judged]),
    )


def _edges(solid: NDArray[np.float32], umbra: FloatArray | None) -> ShadowEdges:
    """Those on lines along the second axis."""
    nothing = np.full((1, solid.shape[1]), -np.inf, dtype=np.float32)
    padded = np.concatenate([nothing, solid, nothing])
    line, place = np.nonzero(padded[:-1] != padded[1:])
    before, after = padded[line, place], padded[line + 1, place]
    height, side = np.maximum(before, after), np.where(after > before, 1, -1).astype(np.int8)
    judged = np.zeros(len(line), dtype=np.bool_)
    if umbra is not None:
        nothing = np.full((1, solid.shape[1]), np.nan)
        hidden = np.concatenate([nothing, umbra, nothing])[line + (side < 0), place]
        judged = ~np.isnan(hidden)
        kept = ~(hidden >= height)
        line, place, height, side, judged = (
            one[kept] for one in (line, place, height, side, judged)
        )
    same = np.zeros(len(line), dtype=np.bool_)
    same[1:] = np.diff(place) == 1
    for one in (line, height, side, judged):
        same[1:] &= one[1:] == one[:-1]
    first = np.flatnonzero(~same)
    last = np.append(first[1:], len(line)) - 1 if len(line) else first
    ends = np.stack([line[first], place[first], line[first], place[last] + 1], axis=1)
    return ShadowEdges(ends.astype(np.int32), height[first], side[first], judged[first])
