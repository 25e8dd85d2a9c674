"""Boxes that lie beside a view, in float64: what the truth leaves out must not be seen."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import kernel
from simplifier.kernels.perspective import COLUMNS, NEAR, ROWS, project_point


@kernel("float64[:, :, :], float64[:], bool[:]")
def mark_outside(boxes, view, outside):
    """Fill ``outside`` (n,) bool: which boxes have all corners beyond a plane of the frustum.

    ``boxes``  (n, 2, 3) float64, lowest and highest corners.  What is not a number is not outside.
    ``view``   (16,) float64, :mod:`perspective`.
    """
    rows, columns, near = view[ROWS], view[COLUMNS], view[NEAR]
    for index in range(len(boxes)):
        farthest, most_x, most_y, least_x, least_y = -np.inf, -np.inf, -np.inf, -np.inf, -np.inf
        doubt = 0.0  # NaN as soon as something is not finite
        for corner in range(8):
            x, y, z = project_point(
                view, boxes[index, corner & 1, 0], boxes[index, (corner >> 1) & 1, 1],
                boxes[index, corner >> 2, 2],
            )  # fmt: skip
            doubt += 0.0 * (x + y + z)
            farthest = max(farthest, z)
            most_x, most_y = max(most_x, x), max(most_y, y)
            least_x, least_y = max(least_x, columns * z - x), max(least_y, rows * z - y)
        beside = farthest < near or min(most_x, most_y, least_x, least_y) < 0.0
        outside[index] = doubt == 0.0 and beside
