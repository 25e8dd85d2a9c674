"""The look-up grid of a file of visible sets: square tiles, each with the cells that touch it.

A reader finds the tile of a point and tests only the cells that it lists.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.view_cells import ViewCells

_MOST_ENTRIES, _MOST_TILES = 4, 2  # a cell: a regular grid of square ones takes fewer
_COARSE = 2.0  # of the median cell's edge: a few more cells to test, and half the bytes
_MARGIN = 2.0**-21  # of the largest coordinate; float32 puts a point less than this off
_COARSER = 2.0**0.25  # the next edge that is tried


@dataclass(frozen=True, eq=False)
class TileGrid:
    """Tiles in the plane of the cells' x and y.

    A point's tile is ``floor((point - low) / edge)``, held to the grid along each axis.  Every cell
    is listed in each tile that the box around its plan touches, and a bit around it, so that a
    reader that computes in float32 misses none.

    ``low``     (2,) float32: the corner of tile (0, 0).
    ``edge``    float32: of a tile.
    ``shape``   tiles along x and y; tile (i, j) is number ``i + shape[0] * j``.
    ``starts``  (tiles + 1,) int64: where each tile begins in ``cells``, and the end.
    ``cells``   (k,) int64: ascending in each tile.
    """

    low: NDArray[np.float32]
    edge: np.float32
    shape: tuple[int, int]
    starts: NDArray[np.int64]
    cells: NDArray[np.int64]


def tile_grid(cells: ViewCells) -> TileGrid:
    """About a tile for four cells that touch.

    Coarser where a few large cells among small ones would be listed often.  Coordinates have to be
    below 1e36, so that float32 holds the grid around them.
    """
    count = len(cells)
    if count == 0:
        nothing = np.zeros(2, dtype=np.int64)
        return TileGrid(np.zeros(2, np.float32), np.float32(1.0), (1, 1), nothing, nothing[:0])
    low, high = cells.low[:, :2], cells.high[:, :2]
    most = _MOST_TILES * count
    edge = _COARSE * float(np.median((high - low).max(axis=1)))
    # Finer ones have too many tiles along one axis alone, perhaps more than a whole number holds.
    edge = max(edge, float((high.max(axis=0) - low.min(axis=0)).max()) / most)
    while True:
        corner, tile, first, last = _tiles(low, high, edge)
        columns, rows = (int(number) + 1 for number in last.max(axis=0))
        entries = float((last - first + 1).astype(np.float64).prod(axis=1).sum())
        if columns * rows <= most and entries <= _MOST_ENTRIES * count:
            break
        edge *= _COARSER
    starts, listed = _lists(first, last, columns, rows)
    return TileGrid(corner, tile, (columns, rows), starts, listed)


def _tiles(
    low: FloatArray, high: FloatArray, edge: float
) -> tuple[NDArray[np.float32], np.float32, NDArray[np.int64], NDArray[np.int64]]:
    """Corner and edge of the grid, and the first and last tile (n, 2) of each cell.

    The grid begins a quarter of a tile before the cells, so that the borders of a regular grid lie
    within tiles and rounding moves none into a further one.
    """
    tile = np.float32(edge)
    corner = (low.min(axis=0) - 0.25 * tile).astype(np.float32)
    margin = _MARGIN * float(np.abs([low, high]).max())
    first = np.floor((low - margin - corner) / np.float64(tile))
    last = np.floor((high + margin - corner) / np.float64(tile))
    return corner, tile, np.maximum(first, 0.0).astype(np.int64), last.astype(np.int64)


def _lists(
    first: NDArray[np.int64], last: NDArray[np.int64], columns: int, rows: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where each tile begins, and the cells of all tiles."""
    wide, tall = (last - first + 1).T
    cells = np.repeat(np.arange(len(first)), wide * tall)
    begins = np.cumsum(wide * tall) - wide * tall
    within = np.arange(len(cells)) - begins[cells]
    column = first[cells, 0] + within % wide[cells]
    tile = column + columns * (first[cells, 1] + within // wide[cells])
    starts = np.cumsum(np.bincount(tile + 1, minlength=columns * rows + 1))
    return starts, cells[np.argsort(tile, kind="stable")]
