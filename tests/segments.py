"""Segments against triangles, plainly: what a line of sight meets."""

from __future__ import annotations

import numpy as np


def crossings(starts, ends, triangles):
    """(n,) how many of (m, 3, 3) ``triangles`` each segment crosses (Moller and Trumbore)."""
    direction = (ends - starts)[:, None]
    a, b, c = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(direction, c)
    determinant = (p * b).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / determinant
        away = starts[:, None] - a
        u = (away * p).sum(axis=2) * inverse
        q = np.cross(away, b)
        v = (direction * q).sum(axis=2) * inverse
        t = (c * q).sum(axis=2) * inverse
        met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t >= 0.0) & (t <= 1.0)
    return met.sum(axis=1)


def outside(points, mesh):
    """(n,) whether each point is outside of a closed mesh, by the parity of a ray."""
    far = points + np.array([1.0, 0.61803, 0.31831]) * 10.0 * float(mesh.extent.max())
    return crossings(points, far, mesh.vertices[mesh.faces]) % 2 == 0
