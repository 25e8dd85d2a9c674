"""HeightField -> what the kernels of cull maps read: heights as codes of two bytes, in squares.

A square of 4 x 4 pixels is half a line of memory, so rays along either axis read the same arrays.
Codes round down what hides and up what may be seen, so that sets only grow by rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.cull_map import BLOCK, TILE
from simplifier.visibility.cull_maps.erosion import Window, shrunk
from simplifier.visibility.solid.height_field import HeightField
from simplifier.visibility.solid.object_heights import Heights, rounded_down

_STEPS = 65000  # between the codes of the lowest and of the highest, at most
_MOST = 65535
_FINEST = 1e-6  # of a pixel: codes are no finer
_AT_ONCE = 1 << 16  # heights of objects that are coded at once, which takes little memory
_STRIP = 8 * TILE  # pixels along x that are shrunk and coded at once

HeightCodes = NDArray[np.uint16]


@dataclass(frozen=True)
class Codes:
    """Heights as whole numbers from 1 to 65535; 0 stands for none.

    ``low`` is the height of code 1, a multiple of ``step``, the height between two codes.  That is
    a power of two: heights of few binary places, as houses' mostly are, lose nothing.
    """

    low: float
    step: float

    @classmethod
    def of(cls, field: HeightField) -> Codes:
        """Codes that all objects' tops and all that is solid have."""
        tops, inner = field.object_tops, field.inner
        low, high = float(tops.min(initial=np.inf)), float(tops.max(initial=-np.inf))
        for begin in range(0, len(inner), _STRIP):
            strip = inner[begin : begin + _STRIP]
            low = min(low, float(strip.min(initial=np.inf, where=strip > -np.inf)))
        if low > high:  # nothing that can be seen
            low = high = 0.0
        step = 2.0 ** np.ceil(np.log2(max((high - low) / _STEPS, _FINEST * field.cell)))
        return cls(float(np.floor(low / step) * step), float(step))

    def place(self, height: float) -> float:
        """A height among the codes, of any size."""
        return (height - self.low) / self.step + 1.0

    def heights(self, places: NDArray[np.floating]) -> FloatArray:
        """The heights of places among the codes."""
        return np.asarray(self.low + self.step * (places.astype(np.float64) - 1.0))

    def solid(self, codes: HeightCodes) -> Heights:
        """The heights of what hides, minus infinite where there is none."""
        heights = self.heights(codes.astype(np.float64))
        heights[codes == 0] = -np.inf
        return rounded_down(heights)

    def down(self, heights: Heights) -> HeightCodes:
        """The codes of what hides: no higher."""
        places = np.floor((heights - np.float64(self.low)) / self.step + 1.0)
        return np.asarray(np.clip(places, 0.0, _MOST).astype(np.uint16))

    def up(self, heights: Heights) -> HeightCodes:
        """The codes of what may be seen: no lower."""
        places = np.ceil((heights - np.float64(self.low)) / self.step + 1.0)
        return np.asarray(np.clip(places, 0.0, _MOST).astype(np.uint16))


@dataclass(frozen=True, eq=False)
class CodedField:
    """A field as the kernels take it.  All of it is made when it is first asked for.

    Squares of 4 x 4 pixels are (bx, by, 4, 4); pixels of these beyond the raster have code 0.
    """

    field: HeightField

    @cached_property
    def codes(self) -> Codes:
        return Codes.of(self.field)

    @cached_property
    def object_codes(self) -> HeightCodes:
        """(k,) how high the objects of the pixels are, no lower."""
        tops = self.field.object_tops
        result = np.empty(len(tops), dtype=np.uint16)
        for begin in range(0, len(tops), _AT_ONCE):
            result[begin : begin + _AT_ONCE] = self.codes.up(tops[begin : begin + _AT_ONCE])
        return result

    @cached_property
    def _tops(self) -> tuple[HeightCodes, HeightCodes]:
        """In squares, the higher of the objects and of the solid in each pixel; and the highest
        objects in tiles.
        """
        shape = _squares(self.field)
        tops = np.empty((*shape, BLOCK, BLOCK), dtype=np.uint16)
        tiles = [np.empty((0, -(-self.field.shape[1] // TILE)), np.uint16)]
        for begin, end in _strips(self.field):
            highest = self.field.highest(begin, end)
            tiles.append(_highest_of(self.codes.up(highest), TILE))
            some = self.codes.up(np.maximum(highest, self.field.inner[begin:end]))
            tops[begin // BLOCK : -(-end // BLOCK)] = in_squares(some)
        return tops, np.concatenate(tiles)

    @cached_property
    def blocks(self) -> HeightCodes:
        """(bx, by) the highest that the squares hold."""
        return np.asarray(self._tops[0].max(axis=(2, 3)))

    @cached_property
    def pyramid(self) -> tuple[HeightCodes, NDArray[np.int64]]:
        """The highest objects in tiles of ever more pixels, as the kernel takes them."""
        levels, sizes, size, begin = [], [], TILE, 0
        tops = self._tops[1]
        while True:
            levels.append(tops.ravel())
            sizes.append((begin, *tops.shape, size))
            begin += tops.size
            if max(tops.shape) <= 8:
                break
            tops, size = _highest_of(tops, 2), 2 * size
        return np.concatenate(levels), np.array(sizes, dtype=np.int64)

    @cached_property
    def highest(self) -> float:
        """The code of the highest point of all objects."""
        return float(self.object_codes.max(initial=0))

    @cached_property
    def boxes(self) -> tuple[FloatArray, HeightCodes]:
        """(n, 4) low and high x, low and high y of each object in pixels, and (n,) its top."""
        field = self.field
        boxes = (field.footprints - field.low) / field.cell
        tops = np.zeros(len(boxes), dtype=np.uint16)
        np.maximum.at(tops, field.objects, self.object_codes)
        return np.ascontiguousarray(boxes.transpose(0, 2, 1).reshape(-1, 4)), tops

    @cached_property
    def pixels(self) -> tuple[object, ...]:
        """What the kernels read of each pixel, beside the occluders."""
        field = self.field
        return (
            field.shape, field.starts, field.objects, self.object_codes, self._tops[0], self.blocks
        )  # fmt: skip

    @cached_property
    def _erosions(self) -> dict[Window, HeightCodes]:
        return {}

    def erosion(self, window: Window) -> HeightCodes:
        """In squares, the occluders shrunk by a window: no higher.

        Strips of the raster are shrunk one after the other, which takes little memory beside it.
        """
        if window not in self._erosions:
            field, around = self.field, window.reach
            solid = np.empty((*_squares(field), BLOCK, BLOCK), dtype=np.uint16)
            for begin, end in _strips(field):
                before = min(around, begin)
                part = shrunk(field.inner[begin - before : end + around], window, field.beyond)
                some = self.codes.down(part[before : before + end - begin])
                solid[begin // BLOCK : -(-end // BLOCK)] = in_squares(some)
            self._erosions[window] = solid
        return self._erosions[window]


def in_squares(codes: HeightCodes) -> HeightCodes:
    """Rows of pixels (nx, ny) as squares (bx, by, 4, 4)."""
    padded = _padded(codes, BLOCK)
    squares = padded.reshape(-1, BLOCK, padded.shape[1] // BLOCK, BLOCK)
    return np.ascontiguousarray(squares.transpose(0, 2, 1, 3))


def pixels_of(codes: HeightCodes, low: tuple[int, int], high: tuple[int, int]) -> HeightCodes:
    """Pixels from ``low`` to before ``high`` of squares (bx, by, 4, 4), as rows."""
    (x0, y0), (x1, y1) = low, high
    some = codes[x0 // BLOCK : -(-x1 // BLOCK), y0 // BLOCK : -(-y1 // BLOCK)]
    wide, high_ = some.shape[:2]
    rows = some.transpose(0, 2, 1, 3).reshape(wide * BLOCK, high_ * BLOCK)
    x, y = x0 % BLOCK, y0 % BLOCK
    return rows[x : x + x1 - x0, y : y + y1 - y0]


def _squares(field: HeightField) -> tuple[int, int]:
    nx, ny = field.shape
    return -(-nx // BLOCK), -(-ny // BLOCK)


def _strips(field: HeightField) -> Iterator[tuple[int, int]]:
    nx = field.shape[0]
    for begin in range(0, nx, _STRIP):
        yield begin, min(begin + _STRIP, nx)


def _padded(codes: HeightCodes, size: int) -> HeightCodes:
    nx, ny = codes.shape
    return np.pad(codes, ((0, -nx % size), (0, -ny % size)))


def _highest_of(codes: HeightCodes, size: int) -> HeightCodes:
    """The highest of each square of so many."""
    padded = _padded(codes, size)
    squares = padded.reshape(-1, size, padded.shape[1] // size, size)
    return np.asarray(squares.max(axis=(1, 3)))
