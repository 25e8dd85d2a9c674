"""Distances the plain way: every point against everything, no trees and no kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray


def surface_distances(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """(n,) from each of ``points`` (n, 3) to the nearest of ``triangles`` (m, 3, 3)."""
    nearest = np.full(len(points), np.inf)
    for a, b, c in triangles:
        for begin, end in ((a, b), (b, c), (c, a)):
            nearest = np.minimum(nearest, _to_segment(points, begin, end))
        nearest = np.minimum(nearest, _to_inside(points, a, b, c))
    return nearest


def voxel_distances(points: FloatArray, voxels: NDArray[np.int64]) -> FloatArray:
    """(n,) to the nearest unit cube with its low corner at one of ``voxels`` (m, 3)."""
    nearest = np.full(len(points), np.inf)
    for index, point in enumerate(points):  # of which there are fewer by far
        outside = np.maximum(np.maximum(voxels - point, point - voxels - 1.0), 0.0)
        squares = np.einsum("ij,ij->i", outside, outside)
        nearest[index] = np.sqrt(squares.min(initial=np.inf))
    return nearest


def _to_segment(points: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    along = end - begin
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return np.linalg.norm(points - begin, axis=1)
    direction = along / length
    share = np.clip((points - begin) @ direction / length, 0.0, 1.0)
    return np.linalg.norm(points - (begin + share[:, None] * along), axis=1)


def _to_inside(points: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """To the plane where the foot lies within the triangle, infinite elsewhere."""
    ab, ac = b - a, c - a
    scale = max(float(np.abs(ab).max()), float(np.abs(ac).max()), 1e-300)
    normal = np.cross(ab / scale, ac / scale)
    length = float(np.linalg.norm(normal))
    if length < 1e-12:  # so thin that its edges answer for it
        return np.full(len(points), np.inf)
    normal /= length
    height = (points - a) @ normal
    feet = points - height[:, None] * normal
    within = np.ones(len(points), dtype=np.bool_)
    for begin, end in ((a, b), (b, c), (c, a)):
        within &= np.cross(end - begin, feet - begin) @ normal >= 0.0
    return np.where(within, np.abs(height), np.inf)
