"""TriangleMesh -> directions: the normals of its large flat parts, to cut along these.

Planes along even directions miss a wall that is turned against the axes by some degrees, and a
section that leans against it covers less of it.
"""

from __future__ import annotations

import math

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.kernels.flats import add_normals
from simplifier.kernels.threads import run_chunks

NO_DIRECTIONS: FloatArray = np.empty((0, 3))

_MOST = 8  # directions: each costs as much time as an even one
_SHARE = 0.03  # of the surface, at least
_BINS = 64  # a side of the square that the hemisphere is unfolded to: two degrees each
_NEAR, _APART = np.cos(np.radians([2.0, 5.0]))  # one part, and directions that are worth a cut each
_DIGITS = 6  # of shares and of unit normals
_BLOCK = 32_768  # triangles whose sums are one, on any number of threads
_AT_ONCE = 32  # blocks, whose sums are held: 4 MiB


def flat_directions(mesh: TriangleMesh) -> FloatArray:
    """(k, 3) float64 unit normals, k at most 8, largest parts first.

    A part is what faces one direction, or its opposite, to within two degrees, wherever it lies:
    the floors of a house are one.  Those along an axis of the grid are left out, as the grid is cut
    along these in any case.
    """
    sums, areas = _by_direction(mesh)
    whole = areas.sum()
    normals = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    parts = []
    for normal in normals[areas > _SHARE / 8.0 * whole]:
        cosines = normals @ normal
        near = np.abs(cosines) > _NEAR  # the seam of a bin may run through a part
        middle = (np.sign(cosines[near, None]) * sums[near]).sum(axis=0)
        share = round(float(areas[near].sum() / whole), _DIGITS)
        parts.append((share, _turned(middle)))
    found = list(np.eye(3))
    for share, normal in sorted(parts, key=lambda part: (-part[0], *part[1])):
        if len(found) == 3 + _MOST or share < _SHARE:
            break
        if np.abs(np.array(found) @ normal).max() < _APART:
            found.append(normal)
    return np.array(found[3:]).reshape(-1, 3)


def directions_of_half(mesh: TriangleMesh) -> int:
    """How few directions, of two degrees and their opposites, half of the surface faces: a few of
    what is flat, hundreds of what is round."""
    areas = np.sort(_by_direction(mesh)[1])[::-1]
    return 1 + int(np.searchsorted(np.cumsum(areas), 0.5 * areas.sum()))


def _turned(vector: FloatArray) -> FloatArray:
    """Of unit length and one of its two signs, rounded: the order of sums must not show."""
    unit = np.round(vector / np.linalg.norm(vector), _DIGITS)
    unit *= np.sign(unit[np.flatnonzero(unit)[0]])
    return np.asarray(unit / np.linalg.norm(unit))


def _by_direction(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Of each bin of directions that any triangle has: the sum of normals (n, 3) as long as twice
    the areas, turned to one hemisphere, and of their lengths (n,).  The mesh is scaled to about 1.
    """
    # A power of two, which changes no digit: squares of areas would leave the range of floats.
    scale = math.ldexp(1.0, -math.frexp(float(mesh.extent.max()))[1])
    total = np.zeros((_BINS * _BINS, 4))
    totals = np.empty((_AT_ONCE, *total.shape))

    def add(begin: int, end: int) -> None:
        for index in range(begin, end):
            start = first + index * _BLOCK
            stop = min(start + _BLOCK, len(mesh.faces))
            totals[index] = 0.0
            add_normals(mesh.vertices, mesh.faces, scale, _BINS, start, stop, totals[index])

    for first in range(0, len(mesh.faces), _AT_ONCE * _BLOCK):
        count = min(math.ceil((len(mesh.faces) - first) / _BLOCK), _AT_ONCE)
        run_chunks(add, count)
        total += totals[:count].sum(axis=0)
    used = total[:, 3] > 0.0
    return total[used, :3], total[used, 3]
