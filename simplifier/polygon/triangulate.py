"""Loop -> triangles (end of section 4.4 of the paper).

Earcut (after D. Eberly, "Triangulation by ear clipping") is the fast way and is right for nearly
all rings; its result is checked by area, and where it fails the chain's own ears are taken.
"""

from __future__ import annotations

import mapbox_earcut
import numpy as np

from simplifier.geometry.mesh import IntArray
from simplifier.geometry.polygon import Loop, signed_area
from simplifier.kernels.chain import clip_ears, wind_triangles

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
