"""Polygon -> Polygon: Ramer-Douglas-Peucker in a bound (section 4.3 of the paper).

U. Ramer, "An iterative procedure for the polygonal approximation of plane curves" (1972);
D. Douglas, T. Peucker (1973).  Differences: distances are taken to the chord, not to its line; the
loops of one polygon are simplified together; chords that cross are split further.

Polygon -> Loop: holes joined to the outer loop (section 4.3 of the paper, figure 6c).

M. Held, "FIST: fast industrial-strength triangulation of polygons" (2001), section 3, and
D. Eberly, "Triangulation by ear clipping", section 5: from right to left, each hole's rightmost
vertex is joined to a vertex that it sees on its right.
"""

from __future__ import annotations

from itertools import accumulate, pairwise

import numpy as np

from simplifier.geometry.section import Loop, Polygon
from simplifier.kernels.bridge import bridge_loops
from simplifier.kernels.simplify import simplify_loops


def simplify_polygon(polygon: Polygon, tolerance: float) -> Polygon | None:
    """A valid polygon of fewer points, no point of which is further than ``tolerance`` outside.

    ``polygon``    loops that neither cross nor touch, except that a corner may be visited more
                   than once, as loops of pixels do where pixels meet at their corners.
    ``tolerance``  voxels, 0 or more: no point of the result is further than this from ``polygon``.

    Returns a polygon whose loops are strictly simple and apart (windings kept), or None when the
    outer loop collapses to a line.  Corners that touch are first drawn apart, each into its own
    covered side by a thousandth of the shortest edge, so later stages never meet a pinched loop.
    Holes that collapse, or of an area of at most the tolerance squared, are covered: each point of
    them is within the tolerance of their edge.

    Why the bound holds: every point of a loop slides straight to the nearest point of its chord,
    no further than the tolerance; a point that changes sides is passed over on the way.
    """
    loops = (polygon.outer, *polygon.holes)
    points = np.concatenate(loops) if polygon.holes else np.ascontiguousarray(polygon.outer)
    starts = np.array([0, *accumulate(map(len, loops))], dtype=np.int64)
    points, starts = simplify_loops(points, starts, float(tolerance))
    if len(starts) == 1:
        return None
    bounds = starts.tolist()
    outer, *holes = [points[a:b] for a, b in pairwise(bounds)]
    return Polygon(outer, tuple(holes))


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
