"""A terrain over boxes of its plan: below what it is solid, and up to where it may reach.

Posts (mx, my) at whole numbers, squares of four posts (mx - 1, my - 1) between them.  A square may
be split along either diagonal: along the one whose middle is lower the surface is convex, along the
other one concave, and all that it may be is between the two.  Each is linear on both sides of its
diagonal, so its least and its greatest over a box are at the box's corners, or where the diagonal
leaves the box.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.columns import TOUCH
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel


@inline_kernel
def _at(h00, h10, h01, h11, u, v, rising):
    """The height at (u, v) of a square that is split from (0, 0) to (1, 1), or the other way."""
    if rising:
        if u >= v:
            height = h00 + (h10 - h00) * u + (h11 - h10) * v
        else:
            height = h00 + (h11 - h01) * u + (h01 - h00) * v
    elif u + v <= 1.0:
        height = h00 + (h10 - h00) * u + (h01 - h00) * v
    else:
        height = h11 + (h01 - h11) * (1.0 - u) + (h10 - h11) * (1.0 - v)
    return height


@inner_kernel
def square_bounds(h00, h10, h01, h11, u0, u1, v0, v1):
    """The lowest and the highest point of a square's surface over a box, however it is split.

    Heights of the posts at (0, 0), (1, 0), (0, 1) and (1, 1); the box from u0 to u1, v0 to v1.
    """
    rising = h00 + h11 <= h10 + h01  # which split is the lower one
    low, high = np.inf, -np.inf
    for u in (u0, u1):
        for v in (v0, v1):
            low = min(low, _at(h00, h10, h01, h11, u, v, rising))
            high = max(high, _at(h00, h10, h01, h11, u, v, not rising))
    for up in (True, False):  # along both diagonals
        begin, end = (max(u0, v0), min(u1, v1)) if up else (max(u0, 1.0 - v1), min(u1, 1.0 - v0))
        if begin > end:
            continue
        for u in (begin, end):
            height = _at(h00, h10, h01, h11, u, u if up else 1.0 - u, up)
            if up == rising:
                low = min(low, height)
            else:
                high = max(high, height)
    return low, high


@inline_kernel
def _span(begin, end, first, step, count):
    """The first and the last square that an interval touches, which may be outside of all."""
    low = np.int64(np.floor((begin - TOUCH - first) / step))
    high = np.int64(np.floor((end + TOUCH - first) / step))
    return max(low, -1), min(high, count)


@inline_kernel
def _within(begin, end, first, step, square):
    """The part of a square's side that an interval touches, 0 to 1."""
    low = (begin - TOUCH - first) / step - square
    high = (end + TOUCH - first) / step - square
    return min(max(low, 0.0), 1.0), min(max(high, 0.0), 1.0)


@inner_kernel
def _measure(heights, known, x0, x1, y0, y1, first, step, squares):
    """Bounds over a box of the known squares in ``squares`` (first and last along x and y)."""
    low, high = np.inf, -np.inf
    for c in range(squares[0], squares[1] + 1):
        u0, u1 = _within(x0, x1, first[0], step[0], c)
        for r in range(squares[2], squares[3] + 1):
            if not known[c, r]:
                continue
            v0, v1 = _within(y0, y1, first[1], step[1], r)
            least, most = square_bounds(
                heights[c, r], heights[c + 1, r], heights[c, r + 1], heights[c + 1, r + 1],
                u0, u1, v0, v1,
            )  # fmt: skip
            low, high = min(low, least), max(high, most)
    return low, high


@kernel(
    "float64[:, :], bool[:, :], float64[:], float64[:], int64, int32[:, :], float64, "
    "float64[:, :], int32[:], int32[:], float64[:], bool"
)
def measure_pixels(
    heights, known, first, step, tile, numbers, beyond, inner, starts, objects, tops, fill
):  # fmt: skip
    """What a terrain is over the pixels of a raster.

    ``heights`` (mx, my) float64, finite; ``known`` (mx - 1, my - 1) bool: the squares that are.
    ``first``, ``step``  (2,) float64: the first post and from post to post, in pixels.
    ``tile``    squares along a side of a tile; ``numbers`` (k, l) int32 the object of each tile,
                -1 for none; l counts from the last y on, as files have their rows.
    ``beyond``  up to where it is solid outside of the terrain.
    ``inner``   (nx, ny) float64: the lower bound all over the closed pixel; minus infinite where
                squares are missing.
    ``starts``  (nx ny + 1,) int32: objects of each pixel, pixel i at i + 1; with ``fill`` where
                they begin, and ``objects`` int32, ``tops`` float64 are theirs.
    """
    nx, ny = inner.shape
    mx, my = known.shape
    squares = np.empty(4, np.int64)
    for x in range(nx):
        c0, c1 = _span(float(x), x + 1.0, first[0], step[0], mx)
        for y in range(ny):
            r0, r1 = _span(float(y), y + 1.0, first[1], step[1], my)
            place = x * ny + y
            put = starts[place]
            low = np.inf
            covered = True
            if c0 < 0 or c1 >= mx or r0 < 0 or r1 >= my:
                low = beyond
            left, right = max(c0, 0), min(c1, mx - 1)
            near, far = max(r0, 0), min(r1, my - 1)
            if left > right or near > far:
                inner[x, y] = beyond
                continue
            for c in range(left, right + 1):
                for r in range(near, far + 1):
                    covered = covered and known[c, r]
            for column in range(left // tile, right // tile + 1):
                squares[0] = max(left, column * tile)
                squares[1] = min(right, column * tile + tile - 1)
                for row in range((my - 1 - far) // tile, (my - 1 - near) // tile + 1):
                    squares[2] = max(near, my - row * tile - tile)
                    squares[3] = min(far, my - 1 - row * tile)
                    least, most = _measure(
                        heights, known, float(x), x + 1.0, float(y), y + 1.0, first, step, squares
                    )
                    if least > most:
                        continue
                    low = min(low, least)
                    if fill:
                        objects[put], tops[put] = numbers[column, row], most
                        put += 1
                    else:
                        starts[place + 1] += 1
            inner[x, y] = low if covered else -np.inf


@kernel("float64[:, :], bool[:, :], float64[:, :], float64[:], float64[:], float64[:], float64[:]")
def measure_boxes(heights, known, boxes, spacing, lows, highs, slopes):
    """What a terrain is over boxes (n, 4) of low and high x, low and high y, in posts.

    ``lows``, ``highs``  (n,) float64: bounds of the surface; low > high where there is none.
    ``slopes``  (n,) float64: of the flattest triangle there, split either way.
    ``spacing`` (2,) float64: between posts.
    """
    mx, my = known.shape
    first, step = np.zeros(2), np.ones(2)
    squares = np.empty(4, np.int64)
    for box in range(len(boxes)):
        x0, x1, y0, y1 = boxes[box]
        c0, c1 = _span(x0, x1, 0.0, 1.0, mx)
        r0, r1 = _span(y0, y1, 0.0, 1.0, my)
        squares[0], squares[1] = max(c0, 0), min(c1, mx - 1)
        squares[2], squares[3] = max(r0, 0), min(r1, my - 1)
        lows[box], highs[box] = _measure(heights, known, x0, x1, y0, y1, first, step, squares)
        slopes[box] = np.inf
        for c in range(squares[0], squares[1] + 1):
            for r in range(squares[2], squares[3] + 1):
                if not known[c, r]:
                    continue
                for ahead in range(2):
                    for aside in range(2):
                        gain = (heights[c + 1, r + ahead] - heights[c, r + ahead]) / spacing[0]
                        rise = (heights[c + aside, r + 1] - heights[c + aside, r]) / spacing[1]
                        slopes[box] = min(slopes[box], np.sqrt(gain * gain + rise * rise))
