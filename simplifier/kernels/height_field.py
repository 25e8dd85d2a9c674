"""Objects over a raster of square pixels: how high they stand in each, and which touch it.

Pixels (nx, ny); x and y of all places in pixels.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.columns import TOUCH, admits
from simplifier.kernels.compiled.kernel import inline_kernel, kernel


@inline_kernel
def _clipped_heights(p, q, r, x, y, ring, other):
    """Lowest and highest point of a triangle over the closed pixel at (x, y); low > high if none.

    ``ring``, ``other``  (9, 3) scratch: the triangle is clipped by four half-planes in turn.
    """
    ring[0, :], ring[1, :], ring[2, :] = p, q, r
    count = 3
    for side in range(4):
        axis = side // 2
        upper = side % 2 == 1
        bound = (x if axis == 0 else y) + (1.0 + TOUCH if upper else -TOUCH)
        kept = 0
        for index in range(count):
            a = ring[index]
            b = ring[index + 1 if index + 1 < count else 0]
            da = bound - a[axis] if upper else a[axis] - bound
            db = bound - b[axis] if upper else b[axis] - bound
            if da >= 0.0:
                other[kept, :] = a
                kept += 1
            if (da >= 0.0) != (db >= 0.0):
                share = da / (da - db)
                for each in range(3):
                    other[kept, each] = a[each] + share * (b[each] - a[each])
                kept += 1
        count = kept
        for index in range(count):
            ring[index, :] = other[index]
    low, high = np.inf, -np.inf
    for index in range(count):
        low, high = min(low, ring[index, 2]), max(high, ring[index, 2])
    return low, high


@kernel("float64[:, :], int32[:, :], bool[:], int64[:], float64[:, :], float64[:, :]")
def measure_object(vertices, faces, ends_solid, window, roofs, tops):
    """Heights of one object over the pixels of a window.

    ``vertices`` (n, 3) float64, x and y in pixels; ``faces`` (m, 3) int32.
    ``ends_solid`` (m,) bool: whether what is solid from the base up may end at the face.
    ``window``  (2,) int64: the pixel of the first place of the arrays.
    ``roofs``   (wx, wy) float64, infinite at first: the lowest point of such a face.
    ``tops``    (wx, wy) float64, minus infinite at first: the highest point of any face.
    """
    ring, other = np.empty((9, 3)), np.empty((9, 3))
    wx, wy = tops.shape
    for face in range(len(faces)):
        p, q, r = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        x_low, x_high = min(p[0], q[0], r[0]) - TOUCH, max(p[0], q[0], r[0]) + TOUCH
        y_low, y_high = min(p[1], q[1], r[1]) - TOUCH, max(p[1], q[1], r[1]) + TOUCH
        normal = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        sign = 1.0 if normal > 0.0 else -1.0
        x_first = max(np.int64(np.floor(x_low)), window[0])
        x_last = min(np.int64(np.floor(x_high)), window[0] + wx - 1)
        y_first = max(np.int64(np.floor(y_low)), window[1])
        y_last = min(np.int64(np.floor(y_high)), window[1] + wy - 1)
        for x in range(x_first, x_last + 1):
            for y in range(y_first, y_last + 1):
                if not admits(p, q, r, sign, x, y):
                    continue
                low, high = _clipped_heights(p, q, r, float(x), float(y), ring, other)
                if low > high:
                    continue
                i, j = x - window[0], y - window[1]
                tops[i, j] = max(tops[i, j], high)
                if ends_solid[face]:
                    roofs[i, j] = min(roofs[i, j], low)


@kernel("float64[:, :], int64[:], int64[:], bool[:, :], bool[:, :]")
def fill_outline(points, ends, window, crossed, inside):
    """What an outline does to the pixels of a window.

    ``points``  (n, 2) float64: the corners of its rings, each closed, one after the other.
    ``ends``    (k,) int64: where each ring ends.
    ``window``  (2,) int64: the pixel of the first place of the arrays.
    ``crossed`` (wx, wy) bool: set where the outline touches the closed pixel.
    ``inside``  (wx, wy) bool, false at first: whether the pixel's centre is inside, by the parity
                of crossings, holes included; where it is crossed that says nothing.
    """
    wx, wy = crossed.shape
    begin = 0
    for ring in range(len(ends)):
        for index in range(begin, ends[ring] - 1):
            ax, ay = points[index, 0] - window[0], points[index, 1] - window[1]
            bx, by = points[index + 1, 0] - window[0], points[index + 1, 1] - window[1]
            _cross(ax, ay, bx, by, crossed)
            # Rows whose centre is in the half-open range of the edge: all to its right turn over.
            low, high = min(ay, by), max(ay, by)
            first = max(np.int64(np.ceil(low - 0.5)), 0)
            for y in range(first, wy):
                centre = y + 0.5
                if centre >= high:
                    break
                if centre < low:
                    continue
                x = ax + (centre - ay) / (by - ay) * (bx - ax)
                place = max(np.int64(np.ceil(x - 0.5)), 0)
                if place < wx:
                    inside[place, y] = not inside[place, y]
        begin = ends[ring]
    for x in range(1, wx):
        for y in range(wy):
            inside[x, y] ^= inside[x - 1, y]


@inline_kernel
def _cross(ax, ay, bx, by, crossed):
    """Set the closed pixels that a segment touches."""
    wx, wy = crossed.shape
    x_first = max(np.int64(np.floor(min(ax, bx) - TOUCH)), 0)
    x_last = min(np.int64(np.floor(max(ax, bx) + TOUCH)), wx - 1)
    y_low, y_high = min(ay, by), max(ay, by)
    for x in range(x_first, x_last + 1):
        low, high = y_low, y_high
        if ax != bx:
            one = ay + (x - TOUCH - ax) / (bx - ax) * (by - ay)
            two = ay + (x + 1.0 + TOUCH - ax) / (bx - ax) * (by - ay)
            low, high = max(low, min(one, two)), min(high, max(one, two))
        y_first = max(np.int64(np.floor(low - TOUCH)), 0)
        y_last = min(np.int64(np.floor(high + TOUCH)), wy - 1)
        for y in range(y_first, y_last + 1):
            crossed[x, y] = True
