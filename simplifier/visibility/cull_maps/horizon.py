"""The umbra at the border of a window -> what lies beyond the window and is hidden.

Wonka et al. (2000), section 6: the border of a cull map is a section through the umbra, its
*horizon*.  All lines from a cell to what lies beyond pass there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

_ROUNDING = 1e-9  # of a pixel, and of a height


@dataclass(frozen=True, eq=False)
class Horizon:
    """Of a square window; coordinates in its pixels, heights as they are.

    ``umbra``  (size, size): hidden up to there from all of the cell, all over each pixel.
    ``cell``   (2, 2): low and high corner of the cell in plan, in the window; ``eye`` its top.
    """

    umbra: FloatArray
    cell: FloatArray
    eye: float

    def hides(self, boxes: FloatArray, tops: FloatArray) -> BoolArray:
        """(n,) whether the part of boxes (n, 2, 2) up to ``tops`` (n,) beyond the window is hidden.

        True as well of a box that has no such part.
        """
        size = len(self.umbra)
        hidden = np.ones(len(boxes), dtype=np.bool_)
        for axis in (0, 1):
            for far in (True, False):
                border = np.take(self.umbra, size - 1 if far else 0, axis=axis)
                cell, there = self.cell[:, [axis, 1 - axis]], boxes[:, :, [axis, 1 - axis]]
                if not far:
                    cell, there = (_mirrored(one, size) for one in (cell, there))
                hidden &= self._past(border, cell, there, tops)
        return hidden

    def _past(
        self, border: FloatArray, cell: FloatArray, boxes: FloatArray, tops: FloatArray
    ) -> BoolArray:
        """Whether no line passes above the border at the high end of the first axis.

        The lines are looked at in the middle of its pixels.
        """
        ring = len(border) - 0.5
        beyond = boxes[:, 1, 0] > ring
        near = np.maximum(boxes[:, 0, 0], ring)
        far = np.maximum(boxes[:, 1, 0], ring)
        # The share of the way to the box at which a line passes the border.
        most = (ring - cell[0, 0]) / (near - cell[0, 0])
        least = (ring - cell[1, 0]) / (far - cell[1, 0])
        low, high = (
            [(1.0 - share) * cell[end, 1] + share * boxes[:, end, 1] for share in (least, most)]
            for end in (0, 1)
        )
        first, last = np.minimum(*low) - _ROUNDING, np.maximum(*high) + _ROUNDING
        passes = beyond & (last >= 0.0) & (first <= len(border))
        indices = [np.clip(np.floor(one), 0, len(border) - 1).astype(int) for one in (first, last)]
        over = tops - self.eye
        height = self.eye + over * np.where(over > 0.0, most, least)
        lowest = range_minimum(border, *indices)
        return np.asarray(~passes | (height + _ROUNDING <= lowest))


def _mirrored(boxes: FloatArray, size: int) -> FloatArray:
    """Low and high corners (…, 2, 2) with the first axis turned round."""
    turned = boxes[..., ::-1, :].copy()
    turned[..., 0] = size - turned[..., 0]
    turned[..., 1] = boxes[..., 1]
    return np.asarray(turned)


def range_minimum(
    values: FloatArray, first: NDArray[np.int64], last: NDArray[np.int64]
) -> FloatArray:
    """(n,) the least of ``values[first : last + 1]`` each; a table of runs of 1, 2, 4, … values."""
    tables = [values]
    while 2 ** len(tables) <= len(values):
        half = 2 ** (len(tables) - 1)
        tables.append(np.minimum(tables[-1][:-half], tables[-1][half:]))
    level = np.floor(np.log2(last - first + 1)).astype(int)
    result = np.empty(len(first))
    for run in np.unique(level):
        there = level == run
        begin, end = first[there], last[there] + 1 - 2**run
        result[there] = np.minimum(tables[run][begin], tables[run][end])
    return result
