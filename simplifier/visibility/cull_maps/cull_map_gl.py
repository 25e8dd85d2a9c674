"""HeightField + ViewCells -> what each cell may see, by OpenGL: cull maps that grow.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000),
sections 5 and 6.  A cull map is drawn over a window around the cell.  What lies beyond is held
against its horizon; while something is not hidden there, the window becomes twice as large.
Occluders that are hidden themselves are left out of the next map.

Samples and shrunk occluders are those of ``cull_map.py``.  They are shrunk by a whole pixel, of
which the way from the middle of a pixel to its border takes half: a shadow that is drawn a
sixteenth of a pixel too wide hides nothing wrongly.
"""

from __future__ import annotations

from dataclasses import replace
from types import TracebackType

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.umbra import see_over
from simplifier.progress import TellShare, silent
from simplifier.visibility.cull_maps.coded_field import Codes, HeightCodes, pixels_of
from simplifier.visibility.cull_maps.cull_map import CullMaps, samples_by_erosion
from simplifier.visibility.cull_maps.horizon import Horizon
from simplifier.visibility.cull_maps.shadow_edges import shadow_edges
from simplifier.visibility.cull_maps.umbra_buffer import UmbraBuffer

FIRST_WINDOW = 128
"""Pixels along a side of the first map; each next one is twice as large."""

_WIDEST = 8192  # pixels along a side: what lies further away counts as seen
_BEYOND = 2.0**-10  # of the range of heights, that the buffer holds above and below


def check_opengl() -> None:
    """Raise :class:`~simplifier.errors.BackendUnavailableError` where it would be raised later."""
    UmbraBuffer().close()


class OpenGLCullMaps:
    """Cull maps of a height field, by OpenGL, as
    :func:`~simplifier.visibility.cull_maps.cull_map.see_by_cull_maps` makes them.

    Holds an OpenGL context: use it on the thread that made it, and close it or use it in a ``with``
    statement.  Raises :class:`~simplifier.errors.BackendUnavailableError` where there is no OpenGL
    3.3 with EGL.
    """

    def __init__(self, maps: CullMaps) -> None:
        self._maps = maps
        self._buffer = UmbraBuffer()
        tops = maps.field.object_tops
        low, high = (float(tops.min()), float(tops.max())) if len(tops) else (0.0, 1.0)
        spare = _BEYOND * ((high - low) or max(abs(high), 1.0))
        self._range = low - spare, high + spare

    def __enter__(self) -> OpenGLCullMaps:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the context; closing twice does no harm."""
        self._buffer.close()

    @property
    def range(self) -> tuple[float, float]:
        """Heights of the umbra that the maps tell apart: below, nothing is hidden; above, all is
        at the upper one."""
        return self._range

    def see(
        self, cells: ViewCells, tell: TellShare = silent
    ) -> tuple[BoolArray, NDArray[np.int64]]:
        """(c, n) whether each object may be visible from each cell, and (c, 2) what that took:
        edges that were drawn, and pixels of the last map.
        """
        seen = np.zeros((len(cells), len(self._maps.field.footprints)), dtype=np.bool_)
        work = np.zeros((len(cells), 2), dtype=np.int64)
        with self._buffer:
            for cell in range(len(cells)):
                work[cell] = self._see_from(cells, cell, seen[cell])
                tell((cell + 1) / len(cells))
        return seen, work

    def umbra_heights(self, cells: ViewCells, cell: int) -> FloatArray:
        """(nx, ny) float64: the height below which each pixel is hidden from all of a cell.

        As :func:`~simplifier.visibility.cull_maps.cull_map.umbra_heights`, within :attr:`range`.
        Raises :class:`ValueError` for a raster that is larger than what OpenGL draws at once.
        """
        field = self._maps.field
        none = np.zeros(len(field.footprints), dtype=np.bool_)
        groups, free = samples_by_erosion(self._maps, cells, cell, none)
        size = FIRST_WINDOW
        while size < max(field.shape):
            size *= 2
        with self._buffer:
            if size > self._buffer.widest:
                raise ValueError(f"OpenGL draws {self._buffer.widest} pixels at once, not {size}")
            umbra = self._draw(groups, free, np.zeros(2, dtype=np.int64), size, None)[0]
        return np.ascontiguousarray(umbra[: field.shape[0], : field.shape[1]])

    def _see_from(self, cells: ViewCells, cell: int, seen: BoolArray) -> tuple[int, int]:
        """Set ``seen`` (n,) of a cell; the edges that were drawn last, and the pixels."""
        field = self._maps.field
        groups, free = samples_by_erosion(self._maps, cells, cell, seen)
        plan = (np.stack([cells.low[cell, :2], cells.high[cell, :2]]) - field.low) / field.cell
        eye = float(cells.high[cell, 2])
        middle = np.floor(plan.mean(axis=0)).astype(np.int64)
        highest = self._tops()
        boxes = (field.footprints - field.low) / field.cell
        size = FIRST_WINDOW
        while size < np.ptp(plan, axis=0).max() + 4.0:
            size *= 2
        before: Horizon | None = None
        while True:
            low = middle - size // 2
            umbra, edges = self._draw(groups, free, low, size, before)
            if before is not None:  # both are right: what is hidden by either is
                inner = slice(size // 4, size - size // 4)
                umbra[inner, inner] = np.maximum(umbra[inner, inner], before.umbra)
            self._see_in(umbra, low, seen)
            before = Horizon(umbra, plan - low, eye)
            open_ = ~seen
            open_[open_] = ~before.hides(boxes[open_] - low, highest[open_])
            if not open_.any():
                return edges, size * size
            if 2 * size > min(self._buffer.widest, _WIDEST):
                seen |= open_
                return edges, size * size
            size *= 2

    def _draw(
        self,
        groups: list[tuple[HeightCodes, FloatArray]],
        free: NDArray[np.int64],
        low: NDArray[np.int64],
        size: int,
        before: Horizon | None,
    ) -> tuple[FloatArray, int]:
        """The umbra over a window of so many pixels from ``low`` on, and how many edges it took.

        ``before``  of a window of half the size, by which occluders are left out.
        """
        known = None
        if before is not None:
            # The umbra of a pixel is that of its middle.  Light that passes beside it, within a
            # pixel, still meets an occluder that would be left out by it.
            before = replace(before, umbra=ndimage.minimum_filter(before.umbra, 3, mode="nearest"))
            known = np.full((size, size), np.nan)
            known[size // 4 : size - size // 4, size // 4 : size - size // 4] = before.umbra
        self._buffer.begin(size, *self._range)
        count, codes = 0, self._maps.coded.codes
        for erosion, samples in groups:
            solid = _window(erosion, self._maps.field.shape, codes, low, size)
            for x0, x1, y0, y1 in (free - low[[0, 0, 1, 1]]).tolist():
                solid[max(x0, 0) : max(x1 + 1, 0), max(y0, 0) : max(y1 + 1, 0)] = -np.inf
            edges = shadow_edges(solid, known)
            if before is not None:
                hidden = before.hides(edges.boxes - size // 4, edges.heights.astype(np.float64))
                edges = edges.some(edges.judged | ~hidden)
            self._buffer.load(solid, edges)
            count = max(count, len(edges))
            eyes = codes.heights(samples[:, 2]).tolist()
            for (x, y), eye in zip(samples[:, :2].tolist(), eyes, strict=True):
                self._buffer.add(x - low[0], y - low[1], eye)
        return self._buffer.read(), count

    def _see_in(self, umbra: FloatArray, low: NDArray[np.int64], seen: BoolArray) -> None:
        """Set ``seen`` of what reaches out of the umbra in the part of the raster that it has."""
        field = self._maps.field
        first = np.maximum(low, 0)
        last = np.minimum(low + umbra.shape, field.shape)
        if (first >= last).any():
            return
        (x0, y0), (x1, y1) = first - low, last - low
        see_over(
            np.ascontiguousarray(umbra[x0:x1, y0:y1]), int(first[0]), int(first[1]),
            field.shape[1], field.starts, field.objects, field.object_tops, seen,
        )  # fmt: skip

    def _tops(self) -> FloatArray:
        """(n,) the highest point of each object."""
        field = self._maps.field
        tops = np.full(len(field.footprints), -np.inf)
        np.maximum.at(tops, field.objects, field.object_tops)
        return tops


def _window(
    erosion: HeightCodes, shape: tuple[int, int], codes: Codes, low: NDArray[np.int64], size: int
) -> NDArray[np.float32]:
    """(size, size) heights of a raster from a pixel on; minus infinite where it has none."""
    window = np.full((size, size), -np.inf, dtype=np.float32)
    first, last = np.maximum(low, 0), np.minimum(low + size, shape)
    if (first < last).all():
        (x0, y0), (x1, y1) = first - low, last - low
        (a, b), (c, d) = first.tolist(), last.tolist()
        window[x0:x1, y0:y1] = codes.solid(pixels_of(erosion, (a, b), (c, d)))
    return window
