"""How high one must be to see points of a terrain: rays from each over all posts at once.

Posts at whole numbers.  Rays fan out from a point along one axis, between the two diagonals, and
are tested where they cross the lines of posts across that axis.  A segment that is blocked by
heights eroded by ``size`` posts hides all that is within ``size`` posts of its one end, along both
axes, from all that is as near to its other end.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

_SURE = 1e-9  # posts: far above rounding


@inline_kernel
def _served(begin, end, size, gap):
    """The places of the rays that stand for a column from ``begin`` to ``end``: first and last.

    Rays are ``gap`` apart, at most twice ``size``, and each stands for ``size`` to both sides, so
    that those closest to the column's ends are spared where others stand for the ends as well.
    """
    middle, spare = 0.5 * (begin + end), size - 0.5 * gap
    first = min(begin + spare, middle) - 0.5 * gap
    last = max(end - spare, middle) + 0.5 * gap
    return first - _SURE, last + _SURE


@inline_kernel
def _lower(alive, slopes, left, base, gap, ring, place, height, size, ends, out):
    """Lower ``out`` (l,) of the columns along a line by the rays that stand for them."""
    begin = 0
    for column in range(len(ends) - 1):
        if ends[column] >= place + ring + size - _SURE:
            break
        if ends[column + 1] <= place - ring - size + _SURE:
            continue
        first, last = _served(float(ends[column]), float(ends[column + 1]), float(size), gap)
        # The rays along the diagonals stand for what is up to ``size`` beyond them.
        first, last = min(first, place + ring - _SURE), max(last, place - ring + _SURE)
        while begin < left and base + gap * alive[begin] < first:
            begin += 1
        least = np.inf
        index = begin
        while index < left and base + gap * alive[index] <= last:
            least = min(least, slopes[index])
            index += 1
        if least < np.inf:
            out[column] = min(out[column], height + least * ring)


@inner_kernel
def sweep_fan(eroded, line, place, height, ahead, size, lines, ends, cap, alive, slopes, out):
    """Lower ``out`` (k, l) to the least altitude from which a point is seen from each column.

    ``eroded``  (m + 2 p, n + 2 p) float64, p = size + 2: eroded heights of m x n posts, and around.
    ``line``, ``place``, ``height``  the point: its line, and where on that; ``ahead`` 1 or -1, the
                way along the first axis.
    ``size``    of the erosion, posts.
    ``lines``   (m,) int32: the row of columns that a line is looked at for, or -1.
    ``ends``    (l + 1,) int64: the columns' borders along the second axis.
    ``cap``     the highest altitude asked for: what ``out`` begins with.
    ``alive``, ``slopes``  int64 and float64: room for as many rays as there may be.
    """
    pad = size + 2
    count, width = eroded.shape[0] - 2 * pad, eroded.shape[1] - 2 * pad
    rings = count - 1 - line if ahead > 0 else line
    if rings <= 0:
        return
    rays = (rings + size - 1) // size + 1
    low, high = -float(size), width - 1.0 + size
    left = rays + 1
    for ray in range(left):
        alive[ray] = ray
        slopes[ray] = -np.inf
    for ring in range(1, rings + 1):
        here = line + ahead * ring
        posts = eroded[here + pad]
        base, gap, inverse = place - float(ring), 2.0 * ring / rays, 1.0 / ring
        kept = 0
        for index in range(left):
            ray = alive[index]
            at = base + gap * ray
            if at < low or at > high:
                continue
            post = np.int64(at + pad)
            level = posts[post] + (at + pad - post) * (posts[post + 1] - posts[post])
            slope = max(slopes[index], (level - height) * inverse)
            if slope > 0.0 and height + slope * ring >= cap:
                continue  # nor is it seen from below the cap further away
            alive[kept], slopes[kept] = ray, slope
            kept += 1
        left = kept
        if left == 0:
            return
        row = lines[here]
        if row >= 0:
            _lower(alive, slopes, left, base, gap, ring, place, height, size, ends, out[row])


@kernel(
    "int64[:, :], float64[:], float64[:, :], float64[:, :], int64, int32[:], int32[:], "
    "int64[:], int64[:], float64, float64[:, :], float64[:, :]"
)
def sweep_points(
    points, heights, eroded, turned, size, lines_x, lines_y, ends_x, ends_y, cap, out, out_turned
):
    """Lower ``out`` (k, l) to the least altitude from which any of some points is seen.

    ``points``   (b, 2) int64 posts, ``heights`` (b,) float64 of theirs.
    ``turned``, ``out_turned``  ``eroded`` and ``out`` with the other axis first; what is found is
                 the lower of ``out`` and ``out_turned``.
    The rest is as for :func:`sweep_fan`, along x and along y.
    """
    most = max(len(lines_x), len(lines_y)) // size + 3
    alive, slopes = np.empty(most, np.int64), np.empty(most)
    for index in range(len(points)):
        x, y = points[index]
        for ahead in (1, -1):
            sweep_fan(
                eroded, x, y, heights[index], ahead, size, lines_x, ends_y, cap, alive, slopes, out
            )
            sweep_fan(
                turned, y, x, heights[index], ahead, size, lines_y, ends_x, cap, alive, slopes,
                out_turned,
            )  # fmt: skip
