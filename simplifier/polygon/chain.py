"""Loop -> Chain: ever simpler polygons inside the first one (section 4.4 of the paper).

The paper removes, again and again, the vertex whose triangle with its neighbours has the least
area, such that the polygon stays inside the original.  Only ears qualify: a reflex vertex is a
point of the original's boundary, and without it the polygon would cover a neighbourhood of that
point, which is partly outside.  So each step cuts the smallest ear, each polygon lies in all that
came before it, and an ear is never lacking (G. Meisters, "Polygons have ears", 1975).

Loop -> triangles (end of section 4.4 of the paper).

Earcut (after D. Eberly, "Triangulation by ear clipping") is the fast way and is right for nearly
all rings; its result is checked by area, and where it fails the chain's own ears are taken.
"""

from __future__ import annotations

import mapbox_earcut
import numpy as np

from simplifier.geometry.mesh import IntArray
from simplifier.geometry.section import Chain, Loop, Plane, signed_area
from simplifier.kernels.chain import clip_ears, ear_levels, wind_triangles


def simplification_chain(ring: Loop, plane: Plane) -> Chain:
    """Collapse vertices one by one, down to a single triangle.

    ``ring``   (n, 2) plane coordinates, n >= 3, of positive area: counter-clockwise, weakly simple
               as :func:`~simplifier.polygon.simplify.bridge_holes` makes it.
    ``plane``  the plane that it lies in; passed on.

    Vertices that are straight, spikes or repeated go first.  Of equal areas the vertex that comes
    first in the ring goes first.
    """
    return Chain(plane, ring, ear_levels(ring))


_AREA_ERROR = 1e-9


def triangulate(ring: Loop) -> IntArray:
    """(m, 3) int32 rows of ``ring``, counter-clockwise, that cover it once.

    ``ring`` (n, 2): counter-clockwise and weakly simple, n >= 3.  m is n - 2 or less: triangles
    without area, which straight or repeated points give, are left out, so such a point may be in
    no triangle at all.  The areas add up to the ring's, to a billionth of it.
    """
    area = signed_area(ring)
    corners = mapbox_earcut.triangulate_float64(ring, np.array([len(ring)], dtype=np.uint32))
    triangles, covered = wind_triangles(ring, corners)
    if abs(covered - area) > _AREA_ERROR * area:
        triangles, _ = wind_triangles(ring, clip_ears(ring).ravel().astype(np.uint32))
    return np.asarray(triangles)
