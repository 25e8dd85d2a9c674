"""What the formats that store float32 share: the way there and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OutputError
from simplifier.geometry.arrays import cross_products
from simplifier.geometry.mesh import FloatArray

Float32Array = NDArray[np.float32]

_LEAST = float(np.finfo(np.float32).smallest_normal)


_COARSEST = 1e-3  # of the longest edge: moved by more, corners make another shape


def to_float32(points: FloatArray) -> Float32Array:
    """The nearest float32 of ``points`` (..., 3).

    Raises :class:`OutputError` where one would be infinite, where rounding would move a corner by
    more than a thousandth of the points' longest extent, too far out for 24 bits, and where all of
    them are so small that even the largest would lose digits.
    """
    with np.errstate(over="ignore", under="ignore"):
        rounded = points.astype(np.float32)
    if not np.isfinite(rounded).all():
        raise OutputError(
            "a coordinate is too large for 32-bit numbers", remedy="write .ply or .obj instead"
        )
    if 0.0 < float(np.abs(points).max(initial=0.0)) < _LEAST:
        raise OutputError(
            "all coordinates are too small for 32-bit numbers",
            remedy="write .ply or .obj instead, or scale the mesh up",
        )
    corners, moved = points.reshape(-1, 3), np.abs(rounded - points).max(initial=0.0)
    extent = float(np.ptp(corners, axis=0).max()) if len(corners) else 0.0
    if moved > _COARSEST * extent > 0.0:
        raise OutputError(
            f"32-bit numbers would move a corner by {moved:.3g}, and all are within {extent:.3g}",
            remedy="write .ply or .obj instead, or bring it nearer to the origin and to size 1",
        )
    return rounded


def box_centre(points: FloatArray) -> FloatArray:
    """(3,) the middle of the bounding box of ``points`` (n, 3); 0 of none.

    Raises :class:`OutputError` where the box is too large for float64.
    """
    if len(points) == 0:
        return np.zeros(3)
    low, high = points.min(axis=0), points.max(axis=0)
    with np.errstate(over="ignore"):
        extent = high - low
    if not np.isfinite(extent).all():
        raise OutputError("the occluder is too large for 64-bit numbers", remedy="scale it down")
    return np.asarray(low + extent / 2.0)


def to_float64(values: NDArray[Any]) -> FloatArray:
    """Of any numbers; a signalling NaN, which damaged files hold, becomes a quiet one quietly."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def unit_normals(corners: FloatArray) -> Float32Array:
    """(m, 3) unit normals of (m, 3, 3) triangles by the right-hand rule, +z where flat."""
    edges = corners[:, 1:] - corners[:, :1]
    longest = np.abs(edges).max(axis=(1, 2), initial=0.0, keepdims=True)
    edges = edges / np.where(longest > 0.0, longest, 1.0)  # areas must not underflow
    normals = cross_products(edges[:, 0], edges[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    flat = lengths[:, 0] == 0.0
    normals = normals / np.where(lengths > 0.0, lengths, 1.0)
    normals[flat] = (0.0, 0.0, 1.0)
    return normals.astype(np.float32)
