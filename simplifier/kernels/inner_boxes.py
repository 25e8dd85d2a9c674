"""The largest box of voxels that are all inside."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import kernel


@kernel("bool[:, :, :], int64[:, :]")
def search_largest_box(inside, found):
    """Of ``inside`` (nx, ny, nz) bool, into ``found`` (2, 3) int64: first voxel, and one past the
    last; left alone where nothing is inside.

    For each range along x it takes the largest rectangle of what is inside all along it, by the
    histogram of each of its rows.
    """
    nx, ny, nz = inside.shape
    best = 0
    common = np.empty((ny, nz), dtype=np.bool_)
    heights = np.empty(nz + 1, dtype=np.int64)
    starts = np.empty(nz + 1, dtype=np.int64)
    tops = np.empty(nz + 1, dtype=np.int64)
    for first in range(nx):
        common[:] = True
        for last in range(first, nx):
            cells = 0
            for y in range(ny):
                for z in range(nz):
                    common[y, z] &= inside[last, y, z]
                    cells += common[y, z]
            if cells * (nx - first) <= best:
                break
            length = last + 1 - first
            if cells * length <= best:
                continue
            heights[:] = 0
            for y in range(ny):
                waiting = 0
                for z in range(nz + 1):
                    if z < nz:
                        heights[z] = heights[z] + 1 if common[y, z] else 0
                    start = z
                    height = heights[z] if z < nz else 0
                    while waiting > 0 and tops[waiting - 1] >= height:
                        waiting -= 1
                        start = starts[waiting]
                        size = tops[waiting] * (z - start) * length
                        if size > best:
                            best = size
                            found[0, 0], found[1, 0] = first, last + 1
                            found[0, 1], found[1, 1] = y + 1 - tops[waiting], y + 1
                            found[0, 2], found[1, 2] = start, z
                    if z < nz:
                        starts[waiting], tops[waiting] = start, height
                        waiting += 1
