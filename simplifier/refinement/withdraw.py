"""Triangles -> triangles: drawn in until no picture shows them beside the mesh."""

from __future__ import annotations

import numpy as np

from simplifier.device.device import PROCESSOR, Device, soup_masks
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.kernels.coverage import MaskArray

_AT_ONCE = 128  # pictures that are kept together
_STEP = 1.0 / 16.0  # of the way from a corner to the middle of its triangle
_MOST_STEPS = 200  # by then a triangle is next to nothing, and is given up


def withdraw(
    triangles: FloatArray,
    vertices: FloatArray,
    faces: IntArray,
    projections: FloatArray,
    pixels: int,
    enough: int,
    device: Device = PROCESSOR,
) -> FloatArray:
    """The triangles (m, 3, 3), none of which covers a pixel that the mesh does not.

    The pictures are looked at in turn, until ``enough`` in a row show nothing beside the mesh.

    ``vertices`` (n, 3), ``faces`` (k, 3) of the mesh in the same space, ``projections`` (V, 2, 4)
    from there to pictures of ``pixels`` a side, which the ``device`` draws.  Of a triangle that
    does, the corner nearest to what sticks out moves towards the middle, so that it never covers
    what it did not before.
    """
    soup = np.array(triangles)
    kept = np.ones(len(soup), dtype=np.bool_)
    clean = 0
    for first in range(0, len(projections), _AT_ONCE):
        if clean >= enough:
            break
        some = projections[first : first + _AT_ONCE]
        outside = ~device.coverage_masks(vertices, faces, some, pixels, pixels)
        shown = soup_masks(PROCESSOR, soup[kept], some, pixels)
        beside = np.flatnonzero((shown & outside).any(axis=(1, 2)))
        clean = clean + len(some) if len(beside) == 0 else 0
        for view in beside:
            for index in np.flatnonzero(kept):
                kept[index] = _draw_in(soup[index], some[view], outside[view], pixels)
    return soup[kept]


def _draw_in(triangle: FloatArray, projection: FloatArray, outside: MaskArray, pixels: int) -> bool:
    """Move corners until nothing lies outside; whether anything is left of the triangle."""
    for step in range(_MOST_STEPS):
        beside = soup_masks(PROCESSOR, triangle[None], projection[None], pixels)[0] & outside
        rows, words = np.nonzero(beside)
        if len(rows) == 0:
            return step == 0 or not _is_set(outside, projection @ [*triangle.mean(axis=0), 1.0])
        bits = [int(word).bit_length() - 1 for word in beside[rows, words]]
        places = np.stack([64 * words + bits, rows], axis=1) + 0.5
        corners = triangle @ projection[:, :3].T + projection[:, 3]
        away = np.linalg.norm(corners[:, None] - places[None], axis=2).min(axis=1)
        corner = int(away.argmin())
        triangle[corner] += _STEP * (triangle.mean(axis=0) - triangle[corner])
    return False


def _is_set(mask: MaskArray, place: FloatArray) -> bool:
    """Whether the pixel of a place (2,) is, which lies in the picture."""
    column, row = place.astype(np.int64)
    return bool(mask[row, column >> 6] >> np.uint64(column & 63) & np.uint64(1))
