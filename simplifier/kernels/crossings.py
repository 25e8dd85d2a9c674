"""Which of many segments meet another one."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import kernel
from simplifier.kernels.planar import cross


@kernel
def meeting_segments(segments, slack):
    """(m,) bool: whether each of (m, 4) segments x0, y0, x1, y1 meets another one.

    They are swept in order of their least x, so only those that overlap in x are compared.
    """
    count = len(segments)
    least = np.empty(count, np.float64)
    for index in range(count):
        least[index] = min(segments[index, 0], segments[index, 2])
    order = np.argsort(least)
    swept = segments[order]
    least = least[order]
    meets = np.zeros(count, np.bool_)
    for i in range(count):
        ax, ay, bx, by = swept[i, 0], swept[i, 1], swept[i, 2], swept[i, 3]
        right = max(ax, bx) + slack
        for j in range(i + 1, count):
            if least[j] > right:
                break
            if segments_meet(
                ax, ay, bx, by, swept[j, 0], swept[j, 1], swept[j, 2], swept[j, 3], slack
            ):
                meets[order[i]] = meets[order[j]] = True
    return meets


@kernel
def segments_meet(ax, ay, bx, by, cx, cy, dx, dy, slack):
    """Whether segments ab and cd cross, touch, or come within about ``slack`` of it.

    Segments that share an end point meet only when one runs back along the other.
    """
    if (ay if ay > by else by) + slack < (cy if cy < dy else dy):
        return False
    if (cy if cy > dy else dy) + slack < (ay if ay < by else by):
        return False
    near_ab = slack * np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    near_cd = slack * np.sqrt((dx - cx) ** 2 + (dy - cy) ** 2)
    if ax == cx and ay == cy:
        return _runs_back(ax, ay, bx, by, dx, dy, near_ab + near_cd)
    if ax == dx and ay == dy:
        return _runs_back(ax, ay, bx, by, cx, cy, near_ab + near_cd)
    if bx == cx and by == cy:
        return _runs_back(bx, by, ax, ay, dx, dy, near_ab + near_cd)
    if bx == dx and by == dy:
        return _runs_back(bx, by, ax, ay, cx, cy, near_ab + near_cd)
    to_c = cross(ax, ay, bx, by, cx, cy)
    to_d = cross(ax, ay, bx, by, dx, dy)
    if (to_c > near_ab and to_d > near_ab) or (to_c < -near_ab and to_d < -near_ab):
        return False
    to_a = cross(cx, cy, dx, dy, ax, ay)
    to_b = cross(cx, cy, dx, dy, bx, by)
    return not ((to_a > near_cd and to_b > near_cd) or (to_a < -near_cd and to_b < -near_cd))


@kernel
def _runs_back(x, y, px, py, qx, qy, near):
    """Whether p and q lie in the same direction from the point that their segments share."""
    along = (px - x) * (qx - x) + (py - y) * (qy - y)
    return along > 0.0 and abs(cross(x, y, px, py, qx, qy)) <= near
