"""HeightField + ViewCells -> what each cell may see: cull maps with shrunk occluders, fused.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000).  One
sample on an edge of a cell stands for a piece of that edge: the solid is eroded by the piece and
by a pixel, so that what a sample does not see is hidden from all of the piece, in all of the pixel
(the paper's theorem, for any symmetric convex set in place of a ball).  What all samples do not see
is hidden from the whole cell, since every line from within it leaves through its border, and since
over a height field higher eyes see more.

What stands in the cell is always visible from it, and never hides anything from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import BOX, ViewCells
from simplifier.kernels.cull_map import BLOCK, FIRST_RING, LEAF, see_from_cells
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent
from simplifier.visibility.height_field import HeightField

_CHUNK = 4  # cells that are looked at between two tells


@dataclass(frozen=True, eq=False)
class Erosion:
    """Occluders that are shrunk by a box, beside the objects' tops.

    ``pairs``  (nx, ny, 2) float32, and ``turned`` (ny, nx, 2) the same: memory is read along rays.

    ``reach``  (2,) pixels that the box reaches to each side along x and y, whole numbers.
    """

    pairs: NDArray[np.float32]
    turned: NDArray[np.float32]

    @classmethod
    def of(cls, field: HeightField, reach: tuple[int, int]) -> Erosion:
        """By a box of so many pixels to each side along x and y."""
        shrunk = field.inner
        for axis in (0, 1):
            shrunk = ndimage.minimum_filter1d(
                shrunk, 2 * reach[axis] + 1, axis=axis, mode="constant", cval=-np.inf
            )
        pairs = np.ascontiguousarray(np.stack([shrunk, field.tops], axis=2))
        return cls(pairs, np.ascontiguousarray(pairs.transpose(1, 0, 2)))


@dataclass(frozen=True, eq=False)
class CullMaps:
    """What visibility is looked up in, once for all cells.

    ``spacing``  longest piece of a cell's edge that one sample stands for, in units of the scene.
    """

    field: HeightField
    spacing: float

    @cache  # noqa: B019, as few as there are kinds of edges
    def erosion(self, reach: tuple[int, int]) -> Erosion:
        return Erosion.of(self.field, reach)

    @cache  # noqa: B019
    def highest(self) -> float:
        """The highest point of all objects."""
        return float(self.field.tops.max())

    @cache  # noqa: B019
    def pyramid(self) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """The highest objects in tiles of ever more pixels, as the kernel takes them."""
        levels, sizes, size, begin = [], [], BLOCK, 0
        tops = _blocks(self.field.tops, BLOCK)
        while True:
            levels.append(tops.ravel())
            sizes.append((begin, *tops.shape, size))
            begin += tops.size
            if max(tops.shape) <= 8 and len(levels) > LEAF:
                break
            tops, size = _blocks(tops, 2), 2 * size
        return np.concatenate(levels), np.array(sizes, dtype=np.int64)


def _blocks(values: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """The highest of each square of so many."""
    nx, ny = (-(-count // size) for count in values.shape)
    padded = np.full((nx * size, ny * size), -np.inf, dtype=np.float32)
    padded[: values.shape[0], : values.shape[1]] = values
    return np.asarray(padded.reshape(nx, size, ny, size).max(axis=(1, 3)))


def see_by_cull_maps(
    maps: CullMaps, cells: ViewCells, tell: TellShare = silent
) -> tuple[BoolArray, NDArray[np.int64]]:
    """(c, n) whether each object may be visible from each cell, and (c, 2) what that took: steps
    of rays, and tests of tiles.
    """
    field = maps.field
    seen = np.zeros((len(cells), len(field.footprints)), dtype=np.bool_)
    work = np.zeros((len(cells), 2), dtype=np.int64)
    edges = [_samples(maps, cells, cell, seen[cell]) for cell in range(len(cells))]
    samples = np.concatenate([one[0] for one in edges])
    # Whole pixels, as they are eroded by; a little of rounding in a length is no further pixel.
    x, y = np.maximum(np.ceil(samples[:, 3:5].max(axis=0) - 1e-6), 1.0).astype(int).tolist()
    along_x, along_y = maps.erosion((x, 1)), maps.erosion((1, y))
    starts = np.cumsum([0, *(len(one[0]) for one in edges)])
    free = np.concatenate([one[2] for one in edges])
    free_starts = np.cumsum([0, *(len(one[2]) for one in edges)])
    vertical = np.concatenate([one[1] for one in edges])
    levels, sizes = maps.pyramid()
    rays = FIRST_RING
    while rays < 2 * max(field.shape) + FIRST_RING:
        rays *= 2
    data = (field.starts, field.objects, field.object_tops)

    def look(begin: int, end: int) -> None:
        scratch = (
            np.empty(4 * (2 * rays + 1)), np.zeros(4 * (2 * rays + 1), np.bool_),
            np.empty(int(sizes[LEAF, 1] * sizes[LEAF, 2]), np.int32),
        )  # fmt: skip
        see_from_cells(
            begin, end, samples, starts, vertical, along_x.pairs, along_x.turned, along_y.pairs,
            along_y.turned, free, free_starts, data, levels, sizes, scratch, seen, work,
        )  # fmt: skip

    run_chunks(look, len(cells), chunks_per_thread=max(4, len(cells) // _CHUNK), tell=tell)
    return seen, work


def _samples(
    maps: CullMaps, cells: ViewCells, cell: int, seen: BoolArray
) -> tuple[FloatArray, BoolArray, NDArray[np.int64]]:
    """Samples on the border of a box cell, which run along y, and the pixels that are free.

    What stands in the cell is set in ``seen``.
    """
    field = maps.field
    assert cells.kinds[cell] == BOX
    low, high = cells.low[cell], cells.high[cell]
    plans = field.footprints
    inside = (plans[:, 0] <= high[:2]).all(axis=1) & (plans[:, 1] >= low[:2]).all(axis=1)
    seen |= inside
    rows, vertical = [], []
    (x0, y0), (x1, y1) = ((corner[:2] - field.low) / field.cell for corner in (low, high))
    for along, begin, end, others in ((0, x0, x1, (y0, y1)), (1, y0, y1, (x0, x1))):
        count = int(np.ceil((end - begin) * field.cell / maps.spacing - 1e-9))
        half = 0.5 * (end - begin) / count
        for middle in begin + half * (2 * np.arange(count) + 1):
            for other in others:
                place = (middle, other) if along == 0 else (other, middle)
                ex, ey = (half, 0.0) if along == 0 else (0.0, half)
                rows.append([*place, high[2], ex, ey, maps.highest()])
                vertical.append(along == 1)
    reach = max(int(np.ceil(0.5 * maps.spacing / field.cell)), 1)
    boxes = (plans[inside] - field.low) / field.cell
    first = np.floor(boxes[:, 0]).astype(np.int64) - reach - 1
    last = np.floor(boxes[:, 1]).astype(np.int64) + reach + 1
    free = np.stack([first[:, 0], last[:, 0], first[:, 1], last[:, 1]], axis=1)
    return np.array(rows), np.array(vertical), free
