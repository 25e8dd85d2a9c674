"""The exact Euclidean distance transform of voxels, a row at a time.

P. Felzenszwalb, D. Huttenlocher, "Distance Transforms of Sampled Functions" (2012): along each axis
in turn, the lower envelope of parabolas.  All lengths are in half voxels and whole numbers, so that
a set voxel may count as a cube: a cube's nearest point is the apex of the parabola.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.threads import run_chunks

FAR = 1 << 30
"""Stands for "no set voxel yet"; more than the squared diagonal of a grid of 4096 voxels."""


_LEAST_ROWS = 64  # fewer are not worth a hand-over to another thread


def squared_distances(sites: NDArray[np.bool_], edge: int) -> NDArray[np.int32]:
    """Squared Euclidean distance of every voxel to the nearest of ``sites``, exact.

    ``sites``  (nx, ny, nz) bool.
    ``edge``   0, 1 or 2: what a site is, a cube of that many voxels around its centre.  0 gives
               distances between centres, 1 from a centre to a voxel, 2 between voxels.

    Returns (nx, ny, nz) int32 squares of HALF voxels, all whole numbers; 2**30 where there is no
    site at all.
    """
    squares = np.where(sites, np.int32(0), np.int32(FAR))
    for axes in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
        _dilate_rows(squares.transpose(axes), edge)
    return squares


def _dilate_rows(planes: NDArray[np.int32], edge: int) -> None:
    """Along the last axis, in place: a turned copy would double the memory."""

    def work(begin: int, end: int) -> None:
        for place in range(begin, end):
            rows = np.ascontiguousarray(planes[place])
            spread_rows(rows, edge, 0, len(rows))
            planes[place] = rows

    run_chunks(work, len(planes), least=max(1, _LEAST_ROWS // planes.shape[1]))


@inner_kernel
def _raise_apexes(row, edge, apexes):
    """Parabolas of a row whose sites have an edge of 0, 1 or 2 voxels; their first position.

    Sites of edge 1 meet half-way between two voxels, those of edge 2 at the neighbours' centres.
    """
    n = len(row)
    if edge == 1:
        apexes[0] = row[0]
        for i in range(1, n):
            apexes[i] = min(row[i - 1], row[i])
        apexes[n] = row[n - 1]
        return -1, n + 1
    for i in range(n):
        apexes[i] = row[i]
        if edge == 2:
            apexes[i] = min(row[max(i - 1, 0)], row[i], row[min(i + 1, n - 1)])
    return 0, n


@kernel("int32[:, :], int64, int64, int64")
def spread_rows(rows, edge, begin, end):
    """Carry squared distances along ``rows[begin:end]``, in place.

    ``rows`` (m, n) int32: at first 0 for a set voxel and :data:`FAR` elsewhere, later what the
    passes before have left.  ``edge`` is 0, 1 or 2: each set voxel is a cube of that many voxels
    around its centre, and distances run from the voxels' centres to these cubes, so 1 gives the
    distance from a centre to a voxel and 2 that between two voxels.  Squares of half voxels.
    """
    n = rows.shape[1]
    apexes = np.empty(n + 1, np.int64)
    places = np.empty(n + 1, np.int64)
    begins = np.empty(n + 1, np.int64)
    for index in range(begin, end):
        row = rows[index]
        first, count = _raise_apexes(row, edge, apexes)
        last = -1
        for k in range(count):
            if apexes[k] >= FAR:
                continue
            place = first + 2 * k
            start = np.int64(0)
            while last >= 0:
                other = places[last]
                gap = apexes[k] - apexes[(other - first) // 2] + (place - other) * (place + other)
                # Voxel i, at 2 i, is nearer to the new one from here on.
                start = max(np.int64(0), gap // (4 * (place - other)) + 1)
                if start > begins[last]:
                    break
                last -= 1
                start = np.int64(0)
            if start < n:
                last += 1
                places[last] = place
                begins[last] = start
        for i in range(n - 1, -1, -1):
            if last < 0:
                break
            away = 2 * i - places[last]
            row[i] = min(np.int64(row[i]), away * away + apexes[(places[last] - first) // 2])
            if i == begins[last]:
                last -= 1
