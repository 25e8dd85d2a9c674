"""Surface -> few triangles: decimated to a budget, then moved into the allowed voxels."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray, IntArray, have_area
from simplifier.kernels.decimate import decimate
from simplifier.kernels.soup_views import all_contained
from simplifier.refinement.sinking import sunk


def decimated(
    vertices: FloatArray, faces: IntArray, allowed: BoolArray, margin: float, budget: int
) -> tuple[FloatArray, IntArray]:
    """At most ``budget`` (1 or more) triangles near a surface; grid space.

    ``vertices`` (n, 3), ``faces`` (m, 3) with no vertex twice in a face and no face twice.
    ``allowed`` (nx, ny, nz) bool: point p of grid space lies in its voxel floor(p + margin).  Faces
    keep to its voxels where they can; those that do not share no vertex with others, so that the
    caller may shrink or drop them.

    Returns ``vertices`` (k, 3) float64, all used and none outside the array, and ``faces`` int32,
    none without area.
    """
    points = np.ascontiguousarray(vertices + margin, dtype=np.float64)
    corners = np.array(faces, dtype=np.int32)
    alive = np.ones(len(corners), dtype=np.bool_)
    if len(corners) > budget:
        decimate(points, corners, allowed, budget, alive)
    points, corners = _used(points, corners[alive])
    points = np.clip(sunk(points, corners, allowed), 0.0, np.array(allowed.shape, np.float64))
    points, corners = _detached(points, corners[have_area(points[corners])], allowed)
    return points - margin, corners


def _detached(
    points: FloatArray, faces: IntArray, allowed: BoolArray
) -> tuple[FloatArray, IntArray]:
    """Give the faces that are outside vertices of their own: mending them leaves the others be."""
    inside = np.zeros(len(faces), dtype=np.bool_)
    all_contained(points[faces], allowed, inside)
    outside = faces[~inside]
    apart = faces.copy()
    apart[~inside] = len(points) + np.arange(outside.size).reshape(-1, 3)
    return _used(np.concatenate([points, points[outside].reshape(-1, 3)]), apart)


def _used(points: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    used, renumbered = np.unique(faces, return_inverse=True)
    return points[used], np.ascontiguousarray(renumbered.reshape(-1, 3), dtype=np.int32)
