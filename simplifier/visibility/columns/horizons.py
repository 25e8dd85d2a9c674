"""Terrain -> horizons: from which altitude on each tile is seen from over each other one.

Zaugg and Egbert, *Voxel Column Culling: Occlusion Culling for Large Terrain Models* (2001), section
3.2: below its horizon in a column a tile is never visible.  They look for it from above, voxel by
voxel, along lines between samples.  Here a sweep from a point of the tile tells for all columns at
once from how high it is seen, and what it hides is hidden from all of the column.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import NEVER
from simplifier.kernels.line_sweep import sweep_points
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent
from simplifier.visibility.columns.sweep_posts import SweepPosts
from simplifier.visibility.solid.object_heights import rounded_down, rounded_up
from simplifier.visibility.solid.terrain import Terrain

_SURE = 1e-9  # of heights: far above what rounding adds to an altitude


@dataclass(frozen=True, eq=False)
class AltitudeScale:
    """Altitude k is ``low`` + k ``step``, both float32 numbers; 0 is seen from any altitude."""

    low: float
    step: float

    @classmethod
    def of(cls, low: float, high: float) -> AltitudeScale:
        """From at most ``low`` to at least ``high`` by the numbers that are left beside NEVER."""
        begin = float(rounded_down(np.array(low)))
        exact = np.array((high - begin) / (NEVER - 1))
        return cls(begin, float(np.nextafter(rounded_up(exact), np.float32(np.inf))))

    def counted(self, altitudes: FloatArray) -> NDArray[np.uint16]:
        """The numbers of altitudes, rounded down; 0 for those below the lowest."""
        high = self.low + NEVER * self.step
        margin = _SURE * max(abs(self.low), abs(high))
        steps = np.floor((altitudes - margin - self.low) / self.step)
        return np.clip(steps, 0, NEVER - 1).astype(np.uint16)

    def altitudes(self, numbers: NDArray[np.uint16]) -> FloatArray:
        """What numbers stand for; minus infinite for 0."""
        altitudes = self.low + self.step * numbers.astype(np.float64)
        return np.where(numbers == 0, -np.inf, altitudes)


def horizons(
    posts: SweepPosts,
    terrain: Terrain,
    scale: AltitudeScale,
    high: float,
    tell: TellShare = silent,
) -> NDArray[np.uint16]:
    """(k, l, n) from which altitude on each tile is seen from anywhere in each column.

    ``posts``  of the terrain.
    ``scale``  counts altitudes up to ``high``, the highest one asked for: what is hidden up to
               there has that one's number.

    Columns (k, l) are the tiles' plans as in
    :attr:`~simplifier.visibility.solid.terrain.Terrain.numbers`.  A tile that lacks samples is
    seen from all heights.  ``tell`` hears the share of the tiles that are done, and may raise.
    """
    shape = terrain.numbers.shape
    found = np.zeros((*shape, len(terrain.scene)), dtype=np.uint16)
    tiles = [
        (column, row)
        for column, row in np.argwhere(terrain.numbers >= 0).tolist()
        if not terrain.holed[terrain.numbers[column, row]]
    ]

    def work(begin: int, end: int) -> None:
        for column, row in tiles[begin:end]:
            lowest = tile_altitudes(posts, column, shape[1] - 1 - row, high)[:, ::-1]
            found[:, :, terrain.numbers[column, row]] = scale.counted(lowest)

    run_chunks(work, len(tiles), chunks_per_thread=max(len(tiles), 1), tell=tell)
    return found


def tile_altitudes(posts: SweepPosts, column: int, row: int, high: float) -> FloatArray:
    """(k, l) float64: from which altitude on a tile is seen from the columns of ``posts``.

    At most ``high``.  From over itself a tile is always seen: minus infinite.
    """
    shape = len(posts.x.stands), len(posts.y.stands)
    out, turned = np.full(shape, high), np.full(shape[::-1], high)
    places, tops = posts.targets(column, row)
    sweep_points(
        places, tops, posts.eroded, posts.turned, posts.size, posts.x.lines, posts.y.lines,
        posts.x.ends, posts.y.ends, high, out, turned,
    )  # fmt: skip
    lowest: FloatArray = np.minimum(out, turned.T)
    lowest[column, row] = -np.inf
    return lowest
