"""Section -> Polygon[]: loops along the pixel edges of a slice (section 4.3 of the paper)."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.section import Polygon, Section
from simplifier.kernels.loops import trace_loops


def edge_loops(section: Section) -> list[Polygon]:
    """Trace the pixel edges of each connected piece of the section.

    Covered pixels are connected across edges, uncovered ones across corners too, so pieces that
    meet at a pixel corner are two polygons.  A single loop may still come back to a corner that it
    passed; both visits are then convex corners of the covered side.

    Outer loops are counter-clockwise, holes clockwise; only corners are kept, in plane
    coordinates: ``section.corner + section.pixel * (column, row)`` of the lattice point, exactly
    the same numbers wherever loops meet.  Polygons come in row-major order of their first pixel,
    holes in that of the first pixel above them.
    """
    mask = np.ascontiguousarray(section.mask, dtype=np.bool_)
    corner = np.ascontiguousarray(section.corner, dtype=np.float64)
    points, starts, owner = trace_loops(mask, corner, float(section.pixel))
    bounds = starts.tolist()
    pieces: dict[int, list[FloatArray]] = {}
    # An outer loop has the first pixel of its piece, so it comes before its holes.
    for loop, piece in enumerate(owner.tolist()):
        pieces.setdefault(piece, []).append(points[bounds[loop] : bounds[loop + 1]])
    return [Polygon(outer, tuple(holes)) for outer, *holes in pieces.values()]
