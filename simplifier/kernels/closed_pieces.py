"""Which places lie within closed pieces of a mesh."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, kernel


@inline_kernel
def _passes_below(a, b, x, y):
    """Whether an edge passes below a place in plan; the same numbers from both of its sides."""
    if a[0] > b[0] or (a[0] == b[0] and a[1] > b[1]):
        a, b = b, a
    if not a[0] <= x < b[0]:
        return False
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0.0


@kernel("float64[:, :], int32[:, :], int64[:], float64[:, :], bool[:], bool[:]")
def mark_within(points, faces, pieces, places, odd, within):
    """Set ``within`` (k,) bool for places that are straight below an odd number of a piece's faces.

    ``points``  (n, 3) float64; ``faces`` (m, 3) int32; ``pieces`` (m,) int64, ascending.
    ``places``  (k, 3) float64, ascending along x.
    ``odd``     (k,) bool: all False before and after.
    """
    first, last = len(places), 0  # of the places that the piece may have changed
    for face in range(len(faces)):
        a, b, c = points[faces[face, 0]], points[faces[face, 1]], points[faces[face, 2]]
        top = max(a[2], b[2], c[2])
        south, north = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        place = np.searchsorted(places[:, 0], min(a[0], b[0], c[0]))
        first, east = min(first, place), max(a[0], b[0], c[0])
        while place < len(places) and places[place, 0] <= east:
            x, y, z = places[place, 0], places[place, 1], places[place, 2]
            if south <= y <= north and z < top:
                crossed = _passes_below(a, b, x, y) ^ _passes_below(b, c, x, y)
                if crossed ^ _passes_below(c, a, x, y):
                    u, v = b - a, c - a
                    nx, ny = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2]
                    nz = u[0] * v[1] - u[1] * v[0]
                    height = (a[0] - x) * nx + (a[1] - y) * ny + (a[2] - z) * nz
                    if height * nz > 0.0:
                        odd[place] = not odd[place]
            place += 1
        last = max(last, place)
        if face + 1 == len(faces) or pieces[face + 1] != pieces[face]:
            for place in range(first, last):
                within[place] |= odd[place]
                odd[place] = False
            first, last = len(places), 0
