"""Perspective projection to pixels and clipping, shared by the rasterisers.

A view is sixteen float64:

    0..2    position of the camera, world units
    3..11   three rows that take a point relative to the camera to (x, y, depth); x / depth is in
            pixels to the right, y / depth in pixels downwards, both from the corner of the screen
    12      focal length: pixels that a unit length takes at unit depth
    13      near: the least depth that is drawn
    14, 15  columns and rows of the screen

(x, y, depth) are *homogeneous* pixels: planes through the camera are linear in them, so points are
clipped before the division.  Everything is relative to the camera in float64, so map coordinates
lose nothing that the scene has not lost already.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel

FOCAL, NEAR, COLUMNS, ROWS = 12, 13, 14, 15

GUARD = 32768.0
"""Pixels from the corner of the screen; points further out are clipped before the division."""

CORNERS = 8
"""A triangle clipped by the near plane and four guard planes has at most so many."""

_LARGEST = 1e100  # beyond it products overflow; such triangles are left out


@inline_kernel
def project_point(view, x, y, z):
    """Homogeneous pixels of a point, world units."""
    x -= view[0]
    y -= view[1]
    z -= view[2]
    return (
        view[3] * x + view[4] * y + view[5] * z,
        view[6] * x + view[7] * y + view[8] * z,
        view[9] * x + view[10] * y + view[11] * z,
    )


@inline_kernel
def is_drawable(x, y, depth, near):
    """Whether homogeneous pixels may be divided: before the near plane and not too far out."""
    far = GUARD * depth
    return near <= depth < _LARGEST and abs(x) <= far and abs(y) <= far


@inline_kernel
def _side(polygon, corner, plane, near, guard):
    """Above or at 0 on the side of the plane that is kept."""
    if plane == 0:
        return polygon[corner, 2] - near
    sign = 1.0 if plane & 1 else -1.0
    return guard * polygon[corner, 2] + sign * polygon[corner, (plane - 1) >> 1]


@inner_kernel
def clip(polygon, spare, near, guard):
    """Corners left of the triangle in ``polygon[:3]``, 0 or 3 to 8; it stays in ``polygon``.

    ``polygon``, ``spare``  (8, 3) float64, homogeneous pixels.
    ``guard``               pixels from the corner of the screen beyond which it is clipped.

    A crossing is computed from the end that is kept to the other one, so two triangles that share
    an edge get the same bits for it.
    """
    for corner in range(3):
        size = abs(polygon[corner, 0]) + abs(polygon[corner, 1]) + abs(polygon[corner, 2])
        if not size < _LARGEST:  # so that NaN fails too
            return 0
    count = 3
    for plane in range(5):
        count = _clip_by_plane(polygon, count, plane, near, guard, spare)
        if count < 3:
            return 0
        for corner in range(count):
            for axis in range(3):
                polygon[corner, axis] = spare[corner, axis]
    return count


@inner_kernel
def _clip_by_plane(polygon, count, plane, near, guard, out):
    kept = 0
    for corner in range(count):
        after = corner + 1 if corner + 1 < count else 0
        here = _side(polygon, corner, plane, near, guard)
        there = _side(polygon, after, plane, near, guard)
        if here >= 0.0:
            for axis in range(3):
                out[kept, axis] = polygon[corner, axis]
            kept += 1
        if (here >= 0.0) != (there >= 0.0):
            inner, outer, side = corner, after, here
            if here < 0.0:
                inner, outer, side = after, corner, there
            share = side / (abs(here) + abs(there))
            for axis in range(3):
                step = polygon[outer, axis] - polygon[inner, axis]
                out[kept, axis] = polygon[inner, axis] + share * step
            if plane == 0:
                out[kept, 2] = near
            kept += 1
    return kept


@inline_kernel
def first_centre(value, end):
    """The first integer at or above ``value``, within 0..end."""
    return np.int64(np.ceil(min(max(value, 0.0), float(end))))
