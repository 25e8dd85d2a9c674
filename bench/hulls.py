"""The convex hull in few triangles, which hides most and reaches past all that is not convex.

A hull of more triangles than the budget is thinned from within: it begins with the points furthest
out along the axes and takes in the point furthest from it, again and again, until another one would
exceed the budget.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bench.failure import PeerFailedError
from simplifier.geometry.mesh import FloatArray

Faces = NDArray[np.int64]


def convex_hull(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """The hull of the corners of all faces, at most ``budget`` triangles.

    Raises :class:`PeerFailedError` for what lies in a plane.
    """
    corners = points[np.unique(faces)]
    try:
        whole = ConvexHull(corners)
        if len(whole.simplices) <= budget:
            return corners, whole.simplices.astype(np.int64)
        return _thinned(corners[whole.vertices], budget)
    except QhullError:
        raise PeerFailedError("its hull has no volume") from None


def _thinned(points: FloatArray, budget: int) -> tuple[FloatArray, Faces]:
    """By the vertices of a hull: as n of them have 2 n - 4 triangles, no look at each is needed."""
    chosen = list(dict.fromkeys([*points.argmin(axis=0), *points.argmax(axis=0)]))
    most = budget // 2 + 2
    if len(chosen) < 4 or len(chosen) > most:
        raise PeerFailedError(f"{budget} triangles hold no hull that reaches out along all axes")
    while True:
        hull = ConvexHull(points[chosen])
        if len(chosen) == most:
            return points[chosen], hull.simplices.astype(np.int64)
        normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
        outside = (points @ normals.T + offsets).max(axis=1)
        outside[chosen] = -np.inf
        chosen.append(int(outside.argmax()))
