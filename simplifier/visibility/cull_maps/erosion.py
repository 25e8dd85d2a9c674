"""HeightField -> heights of occluders that are shrunk by a piece of edge and by a pixel.

A sample on an edge of a view cell stands for a piece of it, and a pixel for all points in it.  So
the solid is eroded by a convex set X, symmetric about 0, that holds both: a point of the plan stays
solid up to a height where all that X reaches from there is (docs/decisions/0020-one-erosion.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

_NORMALS = 64  # half-planes in a right angle that a window is cut out by, for the arc of ends
_ROUNDING = 1e-9  # pixels: as much is between what covers a pixel and its border

Heights = NDArray[np.float32]


@dataclass(frozen=True)
class Window:
    """The pixels around one that X reaches from anywhere in it: convex, symmetric about the middle.

    ``axis``  0, x, or 1, y: the one that its lines of pixels lie along.
    ``runs``  first and last pixel of each line, as steps from the middle; an odd number of lines.
    """

    axis: int
    runs: tuple[tuple[int, int], ...]

    @property
    def reach(self) -> int:
        """Pixels to each side along x, at most, that a pixel needs."""
        return max(last for _, last in self.runs) if self.axis == 0 else len(self.runs) // 2

    @classmethod
    def box(cls, x: int, y: int) -> Window:
        """So many pixels to each side along x and y: X is the box that reaches as far."""
        long, short = max(x, y), min(x, y)
        return cls(0 if x >= y else 1, ((-long, long),) * (2 * short + 1))

    @classmethod
    def sector(cls, index: int, count: int, half: float) -> Window:
        """For all pieces of edge that reach at most ``half`` pixels to both sides, and whose
        direction, modulo pi, is at most pi / (2 ``count``) from pi ``index`` / ``count``.

        X is the convex hull of these pieces and of the box of points less than a pixel away along
        either axis.  A pixel at (i, j) belongs to the window where a point of the pixel at 0 plus a
        point of X may lie in it: where (i, j) is in the sum of X and the open square of 2 pixels.
        The sum's width along a normal is the sum of both widths; any choice of normals
        gives no smaller set.
        """
        middle, within = np.pi * index / count, 0.5 * np.pi / count
        angles = np.concatenate(
            [0.5 * np.pi / _NORMALS * np.arange(2 * _NORMALS), _sides(middle, within, half)]
        )
        normals = np.stack([np.cos(angles), np.sin(angles)])
        square = np.abs(normals).sum(axis=0)
        aside = np.abs((angles - middle + 0.5 * np.pi) % np.pi - 0.5 * np.pi)
        pieces = half * np.cos(np.maximum(aside - within, 0.0))
        bound = np.maximum(pieces, square) + square - _ROUNDING
        reach = max(int(np.ceil(half - _ROUNDING)), 1)
        steps = np.arange(-reach, reach + 1)
        places = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1)
        return cls._of_mask((np.abs(places @ normals) < bound).all(axis=2), reach)

    @classmethod
    def _of_mask(cls, mask: BoolArray, reach: int) -> Window:
        wide, high = mask.any(axis=1).sum(), mask.any(axis=0).sum()
        axis = 0 if wide >= high else 1
        lines = mask.T if axis == 0 else mask
        runs = [np.flatnonzero(line)[[0, -1]] - reach for line in lines if line.any()]
        return cls(axis, tuple((int(first), int(last)) for first, last in runs))


def _sides(middle: float, within: float, half: float) -> FloatArray:
    """(8,) directions of the normals of lines from corners of the square to the ends of pieces."""
    ends = half * np.array(
        [[np.cos(turn), np.sin(turn)] for turn in (middle - within, middle + within)]
    )
    corners = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    along = (ends[:, None] - corners).reshape(-1, 2)
    return np.asarray(np.arctan2(along[:, 0], -along[:, 1]))


def sectors(half: float) -> int:
    """How many directions, modulo pi, pieces of ``half`` pixels to both sides are sorted into.

    Within a sector the ends of pieces are about a pixel apart from the middle, which X has to all
    sides anyway.  An even number: turning by a right angle exchanges sectors.
    """
    return max(2 * int(np.ceil(0.25 * np.pi * half - _ROUNDING)), 2)


def sector_of(direction: FloatArray, count: int) -> int:
    """The sector of so many that a direction (2,) is in."""
    turn = np.arctan2(direction[1], direction[0]) / np.pi
    return int(np.round(turn * count)) % count


def shrunk(heights: Heights, window: Window, beyond: float = -np.inf) -> Heights:
    """The lowest height (nx, ny) in the window around each pixel; ``beyond`` outside of all."""
    lines = len(window.runs) // 2
    reach = max(last for _, last in window.runs)
    wide = [(reach, reach), (lines, lines)][:: 1 if window.axis == 0 else -1]
    padded = np.pad(heights, wide, constant_values=beyond)
    lowest, power = (padded.T if window.axis else padded), 1
    result = np.full(heights.shape, np.inf, dtype=np.float32)
    turned = result.T if window.axis else result
    size, across = len(turned), len(turned.T)
    # Runs of twice the length from two of the length, then each length from two that overlap.
    for length in sorted({last - first + 1 for first, last in window.runs}):
        while 2 * power <= length:
            lowest, power = np.minimum(lowest[:-power], lowest[power:]), 2 * power
        rest = length - power
        run = np.minimum(lowest[: len(lowest) - rest], lowest[rest:]) if rest else lowest
        for line, (first, last) in enumerate(window.runs):
            if last - first + 1 == length:
                begin = reach + first
                part = run[begin : begin + size, line : line + across]
                np.minimum(turned, part, out=turned)
    return result
