"""Polygon -> Loop: holes joined to the outer loop (section 4.3 of the paper, figure 6c).

M. Held, "FIST: fast industrial-strength triangulation of polygons" (2001), section 3, and
D. Eberly, "Triangulation by ear clipping", section 5: from right to left, each hole's rightmost
vertex is joined to a vertex that it sees on its right.
"""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from simplifier.geometry.polygon import Loop, Polygon
from simplifier.kernels.bridge import bridge_loops


def bridge_holes(polygon: Polygon) -> Loop:
    """One counter-clockwise ring with the polygon's area, weakly simple.

    ``polygon`` must be valid, its loops apart (as :func:`~simplifier.polygon.simplify` makes
    them).  A bridge is an edge that the ring runs along once in each direction; it touches no
    other vertex.  The ring has the points of all loops and two more a hole; copies of a point are
    equal to the bit.  Without holes it is the outer loop itself.
    """
    if not polygon.holes:
        return polygon.outer
    loops = (polygon.outer, *polygon.holes)
    starts = np.array([0, *accumulate(map(len, loops))], dtype=np.int64)
    return np.asarray(bridge_loops(np.concatenate(loops), starts))
