"""HeightField + ViewCells -> what each cell may see: cull maps with shrunk occluders, fused.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000).  One
sample on an edge of a cell stands for a piece of that edge: the solid is eroded by the piece and
by a pixel, so that what a sample does not see is hidden from all of the piece, in all of the pixel
(the paper's theorem, for any symmetric convex set in place of a ball).  What all samples do not see
is hidden from the whole cell, since every line from within it leaves through its border, and since
over a height field higher eyes see more.

What stands in the cell is always visible from it, and never hides anything from it where it is
higher than the viewers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import PRISM, ViewCells
from simplifier.kernels.close_look import look_from_cells
from simplifier.kernels.columns import TOUCH
from simplifier.kernels.cull_map import FIRST_RING, see_from_cells
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.umbra import lower_umbra
from simplifier.progress import TellShare, silent
from simplifier.visibility.cull_maps.coded_field import CodedField, HeightCodes
from simplifier.visibility.cull_maps.erosion import Window, sector_of, sectors
from simplifier.visibility.solid.height_field import HeightField

Pass = tuple[HeightCodes, FloatArray, NDArray[np.int64]]
"""Shrunk occluders, the samples (s, 6) that look at them, and where those of each cell begin."""

_CHUNK = 4  # cells that are looked at between two tells


@dataclass(frozen=True, eq=False)
class CullMaps:
    """What visibility is looked up in, once for all cells.

    ``spacing``  longest piece of a cell's edge that one sample stands for, in units of the scene.
    ``shared``   the field's codes, where other maps of it have made them.
    """

    field: HeightField
    spacing: float
    shared: CodedField | None = None

    @cached_property
    def coded(self) -> CodedField:
        """The field as the kernels take it."""
        return CodedField(self.field) if self.shared is None else self.shared

    def erosion(self, window: Window) -> HeightCodes:
        """The occluders shrunk by a window, made when it is first asked for."""
        return self.coded.erosion(window)

    @property
    def half(self) -> float:
        """Pixels that a piece of edge reaches to both sides at most."""
        return 0.5 * self.spacing / self.field.cell

    @property
    def reach(self) -> int:
        """Whole pixels that occluders are shrunk by at most, to each side."""
        return max(int(np.ceil(self.half - TOUCH)), 1)

    @property
    def rays(self) -> int:
        """Half a side of the largest ring that rays are followed to."""
        rays = FIRST_RING
        while rays < 2 * max(self.field.shape) + FIRST_RING:
            rays *= 2
        return rays


def see_by_cull_maps(
    maps: CullMaps, cells: ViewCells, tell: TellShare = silent, wanted: BoolArray | None = None
) -> tuple[BoolArray, NDArray[np.int64]]:
    """(c, n) whether each object may be visible from each cell, and (c, 2) what that took: steps
    of rays, and tests of tiles, or of objects.

    ``wanted`` (c, n) bool  objects that are looked for, by default all; no other one is visible.
    """
    field = maps.field
    seen = np.zeros((len(cells), len(field.footprints)), dtype=np.bool_)
    work = np.zeros((len(cells), 2), dtype=np.int64)
    passes, free, free_starts = passes_of(maps, cells, seen)
    coded, rays = maps.coded, maps.rays
    # Made before threads ask for them.
    pixels, (levels, sizes), boxes = coded.pixels, coded.pyramid, coded.boxes

    def look(begin: int, end: int) -> None:
        scratch = (
            np.empty(4 * (2 * rays + 1)), np.zeros(4 * (2 * rays + 1), np.bool_),
            np.empty(max(int(sizes[0, 1] * sizes[0, 2]), seen.shape[1]), np.int32),
        )  # fmt: skip
        for solid, some, starts in passes:
            if wanted is None:
                see_from_cells(
                    begin, end, some, starts, solid, free, free_starts, pixels, levels, sizes,
                    scratch, seen, work,
                )  # fmt: skip
            else:
                look_from_cells(
                    begin, end, some, starts, solid, free, free_starts, pixels, *boxes, scratch,
                    wanted, seen, work,
                )  # fmt: skip

    run_chunks(look, len(cells), chunks_per_thread=max(4, len(cells) // _CHUNK), tell=tell)
    return (seen if wanted is None else seen & wanted), work


def passes_of(
    maps: CullMaps, cells: ViewCells, seen: BoolArray
) -> tuple[list[Pass], NDArray[np.int64], NDArray[np.int64]]:
    """The samples of all cells by what occluders are shrunk by for them; the pixels (m, 4) that are
    free, and (c + 1,) where those of each cell begin, as the kernels take them.

    What stands in a cell is set in ``seen`` (c, n).
    """
    made = [_samples(maps, cells, cell, seen[cell]) for cell in range(len(cells))]
    samples = np.concatenate([one[0] for one in made])
    kinds = np.concatenate([one[1] for one in made])
    owners = np.repeat(np.arange(len(cells)), [len(one[0]) for one in made])
    free = np.concatenate([one[2] for one in made])
    free_starts = np.cumsum([0, *(len(one[2]) for one in made)])
    passes = []
    for window, chosen in _by_window(maps, kinds):
        counts = np.bincount(owners[chosen], minlength=len(cells))
        starts = np.concatenate([[0], np.cumsum(counts)])
        passes.append((maps.erosion(window), samples[chosen], starts))
    return passes, free, free_starts


def _by_window(
    maps: CullMaps, kinds: NDArray[np.int64]
) -> Iterator[tuple[Window, NDArray[np.int64]]]:
    """The samples of each kind of piece, with what the occluders are shrunk by for it.

    It depends on the piece alone, so a cell has the same set whatever others are looked at with it.
    """
    count = sectors(maps.half)
    for kind in np.unique(kinds).tolist():
        if kind < 0:
            window = Window.sector(-1 - kind, count, maps.half)
        else:
            pixels, axis = divmod(kind, 2)
            window = Window.box(1, pixels) if axis else Window.box(pixels, 1)
        yield window, np.flatnonzero(kinds == kind)


def count_windows(cells: ViewCells, pixel: float, half: float) -> int:
    """At most so many windows occluders are shrunk by, where samples stand for ``half`` pixels."""
    lengths = (cells.high - cells.low)[cells.kinds != PRISM, :2] / pixel
    pieces = 0.5 * lengths / np.maximum(np.ceil((lengths - TOUCH) / (2.0 * half)), 1.0)
    whole = np.maximum(np.ceil(pieces - TOUCH), 1.0)
    along_x, along_y = (np.unique(some) for some in whole.T)
    both = int(1.0 in along_x and 1.0 in along_y)  # a pixel to all sides
    prisms = sectors(half) if (cells.kinds == PRISM).any() else 0
    return len(along_x) + len(along_y) - both + prisms


def samples_by_erosion(
    maps: CullMaps, cells: ViewCells, cell: int, seen: BoolArray
) -> tuple[list[tuple[HeightCodes, FloatArray]], NDArray[np.int64]]:
    """The samples (s, 6) on the border of a cell beside the occluders shrunk for them, and the
    pixels (m, 4) that are free, as the kernels take them.

    What stands in the cell is set in ``seen``.
    """
    samples, kinds, free = _samples(maps, cells, cell, seen)
    groups = [
        (maps.erosion(window), samples[chosen])
        for window, chosen in _by_window(maps, kinds)
        if len(chosen)
    ]
    return groups, free


def umbra_heights(maps: CullMaps, cells: ViewCells, cell: int) -> FloatArray:
    """(nx, ny) float64: the height below which each pixel is hidden from all of a cell.

    Minus infinite where nothing is hidden.  What stands in the cell casts no shadow.
    """
    groups, free = samples_by_erosion(maps, cells, cell, np.zeros(len(maps.field.footprints), bool))
    umbra = np.full(maps.field.shape, np.inf)
    for solid, samples in groups:
        for sample in samples:
            # Past the furthest corner of the raster, by the longer axis.
            far = np.abs(np.concatenate([sample[:2], sample[:2] - umbra.shape])).max()
            ring = FIRST_RING
            while ring < far + 1.0:
                ring *= 2
            lower_umbra(sample, ring, solid, free, umbra)
    return maps.coded.codes.heights(umbra)


def _kind(half: FloatArray, kind: int, count: int) -> int:
    """A number for pieces of edge (2,) that take the same window: of boxes whole pixels along an
    axis, one of ``count`` sectors of prisms.
    """
    if kind == PRISM:
        return -1 - sector_of(half, count)
    axis = int(np.argmax(np.abs(half)))
    return 2 * max(int(np.ceil(abs(half[axis]) - TOUCH)), 1) + axis


def _samples(
    maps: CullMaps, cells: ViewCells, cell: int, seen: BoolArray
) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
    """Samples on the upper edges of a cell, the kind of piece that each stands for, and boxes of
    pixels in which nothing hides from it.

    What stands in the cell is set in ``seen``.  Walls may stand at its very border, and a ground
    within it.  Only pixels that are solid within its plan, and higher than its viewers, stop
    hiding: docs/decisions/0020-one-erosion.md.
    """
    field, coded, eye = maps.field, maps.coded, float(cells.high[cell, 2])
    outline, count = cells.outline(cell), sectors(maps.half)
    within = np.zeros(len(seen), dtype=np.bool_)
    within[field.objects_in(outline)] = True
    plans = field.footprints
    within &= (plans[:, 0] <= cells.high[cell, :2]).all(axis=1)
    within &= (plans[:, 1] >= cells.low[cell, :2]).all(axis=1)
    seen |= within if field.holed is None else within | field.holed
    rows, kinds = [], []
    corners = (outline - field.low) / field.cell
    for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.linalg.norm(end - begin))
        # A little of rounding in a length is no further piece, and no further pixel of one.
        parts = max(int(np.ceil((length - TOUCH) / (2.0 * maps.half))), 1)
        half = 0.5 * (end - begin) / parts
        kind = _kind(half, int(cells.kinds[cell]), count)
        for middle in begin + half * (2 * np.arange(parts) + 1)[:, None]:
            rows.append([*middle, coded.codes.place(eye), *np.abs(half), coded.highest])
            kinds.append(kind)
    free = _freed(maps, outline, eye)
    if cells.kinds[cell] != PRISM:
        if field.holed is not None:
            free = _reaching(field, cells.low[cell], cells.high[cell], maps.reach)
        elif field.rooms is not None:
            free = np.concatenate([free, _in_rooms(maps, cells, cell, within)])
    return np.array(rows), np.array(kinds), free


def _in_rooms(maps: CullMaps, cells: ViewCells, cell: int, within: BoolArray) -> NDArray[np.int64]:
    """(m, 4) the pixels that are shrunk away with a cell, what stands in it and its rooms."""
    field = maps.field
    assert field.rooms is not None
    boxes = np.floor((field.footprints[within & field.stands] - field.low) / field.cell)
    corners = np.array([cells.low[cell, :2], cells.high[cell, :2]])
    own = np.floor((corners - field.low) / field.cell).astype(np.int64)
    inner = field.inner[own[0, 0] : own[1, 0] + 1, own[0, 1] : own[1, 1] + 1]
    some = [own[None]] if np.isfinite(inner).any() else []
    boxes = np.concatenate([boxes.astype(np.int64), *some, field.rooms.around(cells, cell)])
    first, last = boxes[:, 0] - maps.reach - 1, boxes[:, 1] + maps.reach + 1
    return np.stack([first[:, 0], last[:, 0], first[:, 1], last[:, 1]], axis=1)


def _freed(maps: CullMaps, outline: FloatArray, eye: float) -> NDArray[np.int64]:
    """(m, 4) first and last x and y of pixels that are shrunk away with what stands in a cell."""
    first, touched = maps.field.touched(outline)
    window = tuple(slice(at, at + size) for at, size in zip(first, touched.shape, strict=True))
    parts, _ = ndimage.label(touched & (maps.field.inner[window] > eye))
    reach = maps.reach
    free = [
        [first[0] + x.start - reach, first[0] + x.stop - 1 + reach,
         first[1] + y.start - reach, first[1] + y.stop - 1 + reach]
        for x, y in ndimage.find_objects(parts)
    ]  # fmt: skip
    return np.array(free, dtype=np.int64).reshape(-1, 4)


def _reaching(
    field: HeightField, low: FloatArray, high: FloatArray, reach: int
) -> NDArray[np.int64]:
    """(m, 4) the pixels in and around a cell where a terrain is as high as the cell, by columns.

    All else of the terrain may hide things from the cell, though it is in it: the upper edges see
    each other above it.
    """
    first = np.floor((low[:2] - field.low) / field.cell).astype(int)
    last = np.floor((high[:2] - field.low) / field.cell).astype(int)
    own = field.inner[first[0] : last[0] + 1, first[1] : last[1] + 1]
    if own.size == 0 or own.max() < high[2]:
        return np.empty((0, 4), dtype=np.int64)
    x0, y0 = np.maximum(first - reach - 1, 0)
    x1, y1 = last + reach + 2
    raised = field.inner[x0:x1, y0:y1] >= high[2]
    columns = [(x, np.flatnonzero(column)) for x, column in enumerate(raised)]
    return np.array(
        [(x0 + x, x0 + x, y0 + ys[0], y0 + ys[-1]) for x, ys in columns if len(ys)],
        dtype=np.int64,
    )
