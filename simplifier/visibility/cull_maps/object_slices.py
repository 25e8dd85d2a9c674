"""CullMaps + ViewCells + what they see -> which slices of each object may be seen.

Yilmaz and Gudukbay, "Conservative occlusion culling for urban visualization using a slice-wise data
structure" (2007), section 4.2: of an object that is visible in part, what is hidden is told by the
largest block of slices at a lower corner of its box that is hidden as a whole.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import SLICES
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.object_slices import hidden_blocks, lower_from_cells
from simplifier.kernels.threads import run_chunks
from simplifier.visibility.cull_maps.cull_map import CullMaps, passes_of

_PAIRS = 1 << 16  # of a cell and an object, of half a kilobyte each, that are looked at together


def slices_by_cull_maps(
    maps: CullMaps, cells: ViewCells, visible: BoolArray, boxes: FloatArray
) -> tuple[BoolArray, NDArray[np.int8]]:
    """(c, n) which of the ``visible`` (c, n) are not hidden after all, and (c, n, 3) int8 their
    slices, as :class:`~simplifier.geometry.pvs.Slices` has them.

    ``boxes``  (n, 2, 3) float64 of the objects, upright, which are cut into slices.

    Nothing of what stands in a cell counts as hidden.
    """
    seen = visible.copy()
    slices = np.zeros((*visible.shape, 3), dtype=np.int8)
    pairs = np.cumsum(visible.sum(axis=1))
    for group in np.split(np.arange(len(cells)), np.flatnonzero(np.diff(pairs // _PAIRS)) + 1):
        owners, objects, blocks = _hidden_blocks(maps, cells.some(group), visible[group], boxes)
        whole = (blocks == (0, 0, SLICES)).all(axis=1)
        seen[group[owners[whole]], objects[whole]] = False
        slices[group[owners], objects] = _drawn(blocks)
    slices[~seen] = 0
    return seen, slices


def _hidden_blocks(
    maps: CullMaps, cells: ViewCells, visible: BoolArray, boxes: FloatArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int8]]:
    """The cell (k,) and the object (k,) of what does not stand in a cell, and its block (k, 3)."""
    within = np.zeros_like(visible)
    parts, owners, objects = hidden_parts(maps, cells, visible, boxes, within)
    lows, sizes = boxes[objects, 0, 2], boxes[objects, 1] - boxes[objects, 0]
    heights, plans = np.ascontiguousarray(sizes[:, 2]), np.ascontiguousarray(sizes[:, :2])
    blocks = np.zeros((len(objects), 3), dtype=np.int8)

    def choose(begin: int, end: int) -> None:
        hidden_blocks(begin, end, parts, lows, heights, plans, blocks)

    run_chunks(choose, len(objects))
    return owners, objects, blocks


def hidden_parts(
    maps: CullMaps, cells: ViewCells, visible: BoolArray, boxes: FloatArray, within: BoolArray
) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
    """(k, 8, 8) up to where the parts of objects in plan are hidden, infinite of those that are
    hidden wholly, with the cell (k,) and the object (k,) of each.

    What stands in a cell is set in ``within`` (c, n), and left out.
    """
    field = maps.field
    passes, free, free_starts = passes_of(maps, cells, within)
    owners, objects = map(np.ascontiguousarray, np.nonzero(visible & ~within))
    starts = np.searchsorted(owners, np.arange(len(cells) + 1))
    parts = np.full((len(objects), SLICES, SLICES), np.inf)
    low, high = boxes[objects, 0], boxes[objects, 1]
    widths = (high - low)[:, :2] / field.cell
    scales = np.divide(SLICES, widths, out=np.zeros_like(widths), where=widths > 0.0)
    corners = (low[:, :2] - field.low) / field.cell
    coded = maps.coded
    first = coded.codes.place(low[:, 2] + (high - low)[:, 2] / SLICES)
    frames = np.column_stack([corners[:, 0], scales[:, 0], corners[:, 1], scales[:, 1], first])
    pixels, (places, tops) = coded.pixels, coded.boxes  # made before threads ask for them
    work = np.zeros((len(cells), 2), dtype=np.int64)

    def look(begin: int, end: int) -> None:
        rays = 4 * (2 * maps.rays + 1)
        scratch = (
            np.empty(rays), np.zeros(rays, np.bool_), np.empty(visible.shape[1], np.int32),
            np.full(visible.shape[1], -1, np.int32),
        )  # fmt: skip
        for solid, samples, sample_starts in passes:
            lower_from_cells(
                begin, end, samples, sample_starts, solid, free, free_starts, pixels, places,
                tops, scratch, objects, starts, frames, parts, work,
            )  # fmt: skip

    run_chunks(look, len(cells), chunks_per_thread=max(4, len(cells)))
    return coded.codes.heights(parts), owners, objects


def _drawn(blocks: NDArray[np.int8]) -> NDArray[np.int8]:
    """(k, 3) what is drawn beside hidden blocks: along the up axis the first slice above them, 0
    where they are as high as the box.
    """
    drawn = blocks.copy()
    drawn[:, 2] = np.where((blocks[:, 2] == 0) | (blocks[:, 2] == SLICES), 0, blocks[:, 2] + 1)
    return drawn
