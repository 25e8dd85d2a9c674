"""Triangles over a grid of upright columns: how high they are, and which of them block a band."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

TOUCH = 1e-9
"""Columns: who comes this near touches, so that rounding does not decide."""


@inline_kernel
def _edge_admits(a, b, sign, x, y):
    """Whether the column at (x, y) reaches over to the left of the edge a -> b."""
    nx = (a[1] - b[1]) * sign
    ny = (b[0] - a[0]) * sign
    reach = max(nx, 0.0) + max(ny, 0.0) + TOUCH * (abs(nx) + abs(ny))
    return nx * (x - a[0]) + ny * (y - a[1]) + reach >= 0.0


@inline_kernel
def admits(p, q, r, sign, x, y):
    """Whether the column at (x, y), which the box of a triangle touches, touches its plan.

    ``sign``  1.0 where the corners are counter-clockwise from above, else -1.0.
    """
    return (
        _edge_admits(p, q, sign, x, y)
        and _edge_admits(q, r, sign, x, y)
        and _edge_admits(r, p, sign, x, y)
    )


@inner_kernel
def _visit(vertices, faces, lows, highs, blocked, mark):
    """Widen ``lows`` and ``highs``, or with ``mark`` set ``blocked`` where a triangle meets them.

    A triangle's heights over a column are those of its plane, within its own: exact where it
    covers the column, and never too few.
    """
    nx, ny = lows.shape
    for face in range(len(faces)):
        p = vertices[faces[face, 0]]
        q = vertices[faces[face, 1]]
        r = vertices[faces[face, 2]]
        x_low, x_high = min(p[0], q[0], r[0]) - TOUCH, max(p[0], q[0], r[0]) + TOUCH
        y_low, y_high = min(p[1], q[1], r[1]) - TOUCH, max(p[1], q[1], r[1]) + TOUCH
        if x_high < 0.0 or y_high < 0.0 or x_low > nx or y_low > ny:
            continue
        bottom, top = min(p[2], q[2], r[2]), max(p[2], q[2], r[2])
        ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        normal = ux * vy - uy * vx
        upright = abs(normal) <= 1e-12 * (abs(ux * vy) + abs(uy * vx))
        slope_x = slope_y = 0.0
        if not upright:
            slope_x = (uz * vy - uy * vz) / normal
            slope_y = (ux * vz - uz * vx) / normal
        half = 0.5 * (abs(slope_x) + abs(slope_y))
        sign = 1.0 if normal > 0.0 else -1.0
        x_first, x_last = max(np.int64(np.floor(x_low)), 0), min(np.int64(np.floor(x_high)), nx - 1)
        y_first, y_last = max(np.int64(np.floor(y_low)), 0), min(np.int64(np.floor(y_high)), ny - 1)
        for x in range(x_first, x_last + 1):
            for y in range(y_first, y_last + 1):
                if not admits(p, q, r, sign, x, y):
                    continue
                low, high = bottom, top
                if not upright:
                    middle = p[2] + slope_x * (x + 0.5 - p[0]) + slope_y * (y + 0.5 - p[1])
                    low = min(max(middle - half, bottom), top)
                    high = max(min(middle + half, top), bottom)
                if not mark:
                    lows[x, y] = min(lows[x, y], low)
                    highs[x, y] = max(highs[x, y], high)
                elif low <= highs[x, y] and high >= lows[x, y]:
                    blocked[x, y] = True


@kernel("float64[:, :], int32[:, :], float64[:, :], float64[:, :]")
def raise_columns(vertices, faces, lows, highs):
    """Widen the heights of all columns that the triangles touch (closed sets).

    ``vertices``  (n, 3) float64: x and y in columns, z a height; ``faces`` (m, 3) int32.
    ``lows``, ``highs``  (nx, ny) float64, at first infinite and minus infinite.

    What lies outside of the grid is left out.
    """
    _visit(vertices, faces, lows, highs, np.zeros((1, 1), np.bool_), False)


@kernel("float64[:, :], int32[:, :], float64[:, :], float64[:, :], bool[:, :]")
def block_columns(vertices, faces, lows, highs, blocked):
    """Set ``blocked`` (nx, ny) bool where a triangle has a height within ``lows`` to ``highs``."""
    _visit(vertices, faces, lows, highs, blocked, True)
