"""The exact Euclidean distance transform of voxels, a row at a time.

P. Felzenszwalb, D. Huttenlocher, "Distance Transforms of Sampled Functions" (2012): along each axis
in turn, the lower envelope of parabolas.  All lengths are in half voxels and whole numbers, so that
a set voxel may count as a cube: a cube's nearest point is the apex of the parabola.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import kernel

FAR = 1 << 30
"""Stands for "no set voxel yet"; more than the squared diagonal of a grid of 4096 voxels."""


@kernel
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


@kernel
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
