"""Terrain -> what sweeps look at: eroded posts, the tiles' columns, and where in them to look.

A point of the plan is stood for by a post within ``size`` posts of it along both axes, so posts
twice that far apart stand for a column, and for a tile.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.visibility.solid.terrain import Terrain

_OPEN = -1e36  # world units, where nothing may hide: far below all heights, and finite


@dataclass(frozen=True, eq=False)
class Axis:
    """The columns along an axis.

    ``ends``   (k + 1,) int64: the posts at their borders.
    ``stands`` for each column the posts that stand for it.
    ``lines``  (m,) int32: the column that a post stands for, or -1.
    """

    ends: NDArray[np.int64]
    stands: tuple[NDArray[np.int64], ...]
    lines: NDArray[np.int32]

    @classmethod
    def of(cls, ends: NDArray[np.int64], size: int) -> Axis:
        stands = tuple(_stands(int(begin), int(end), size) for begin, end in pairwise(ends))
        lines = np.full(int(ends[-1]) + 1, -1, dtype=np.int32)
        for column, posts in enumerate(stands):
            lines[posts] = column
        return cls(ends, stands, lines)


def _stands(begin: int, end: int, size: int) -> NDArray[np.int64]:
    """Posts of a column, none of which its end is one, so that no point is further off."""
    posts = list(range(begin + size, end, 2 * size))
    if not posts or posts[-1] + size < end:
        posts.append(max(end - size, begin))
    return np.array(posts, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class SweepPosts:
    """What sweeps over a terrain look at; x counts from the west, y from the south.

    ``size``    posts to both sides that one stands for.
    ``heights`` (nx, ny) float64, over some base.
    ``eroded``  (nx + 2 p, ny + 2 p) float64, p = size + 2: up to where all is solid within ``size``
                of each post, and of those around the terrain.
    ``turned``  the same with y first.
    ``x``, ``y``  the columns along both.  Column (i, j) is over tile (i, l - 1 - j) of
                :attr:`~simplifier.visibility.solid.terrain.Terrain.numbers`.
    """

    size: int
    heights: FloatArray
    eroded: FloatArray
    turned: FloatArray
    x: Axis
    y: Axis

    @classmethod
    def of(cls, terrain: Terrain, size: int, base: float = 0.0) -> SweepPosts:
        heights = terrain.heights - base
        nx, ny = (length - 1 for length in terrain.heights.shape)
        x = np.append(np.arange(0, nx, terrain.tile), nx)
        # Tiles are counted from the north, so that the last one in the south may be smaller.
        y = np.append(ny - np.arange(0, ny, terrain.tile), 0)[::-1]
        eroded = eroded_posts(heights, terrain.posts, size)
        return cls(
            size, heights, eroded, np.ascontiguousarray(eroded.T),
            Axis.of(x.astype(np.int64), size), Axis.of(np.ascontiguousarray(y, np.int64), size),
        )  # fmt: skip

    def targets(self, column: int, row: int) -> tuple[NDArray[np.int64], FloatArray]:
        """(b, 2) and (b,) the posts that stand for a tile, and the highest point around each.

        The surface is highest at posts, whichever way its squares are split.
        """
        x0, x1 = self.x.ends[column : column + 2]
        y0, y1 = self.y.ends[row : row + 2]
        places, tops = [], []
        for x in self.x.stands[column]:
            for y in self.y.stands[row]:
                around = self.heights[
                    max(x0, x - self.size) : min(x1, x + self.size) + 1,
                    max(y0, y - self.size) : min(y1, y + self.size) + 1,
                ]
                places.append((x, y))
                tops.append(around.max())
        return np.array(places, dtype=np.int64), np.array(tops)


def eroded_posts(heights: FloatArray, posts: BoolArray, size: int) -> FloatArray:
    """(nx + 2 p, ny + 2 p) float64, p = size + 2: a bound of the surface around each post.

    Linear between two neighbours along x or y, it is at a point nowhere above the lowest surface
    within ``size`` of there along both axes, whichever way squares are split.  In the terms of the
    rows of posts: each post beyond the point's row, away from it by up to ``size``, is at least the
    bound at the near neighbour, and those closer by at least both, which is planar.

    What is beyond the border is taken for solid: no line between points of the terrain is there.
    Where a post is missing, which takes its squares with it, nothing is.
    """
    pad = size + 2
    known = np.where(posts, heights, np.inf)
    low = _least(np.pad(known, pad, constant_values=np.inf), size)
    # One post more than that, so that a gap is not filled in by a bound between two neighbours.
    missing = np.pad(~posts, pad, constant_values=False)
    near = ndimage.maximum_filter(missing, 2 * size + 3, mode="constant", cval=False)
    low[~np.isfinite(low)] = float(heights[posts].max())
    low[near] = _OPEN
    return np.ascontiguousarray(low)


def _least(values: FloatArray, size: int) -> FloatArray:
    for axis in (0, 1):
        values = ndimage.minimum_filter1d(
            values, 2 * size + 1, axis=axis, mode="constant", cval=np.inf
        )
    return values
