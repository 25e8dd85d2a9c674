"""Free voxels that see the surface on nearly all sides."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import popcount
from simplifier.kernels.compile import kernel

_LOW, _HIGH = 7, 56  # bits 0 to 2: touched towards the low end of x, y, z; 3 to 5: the high end


@kernel
def count_hollow(touched, least):
    """Count the free voxels of ``touched`` (nx, ny, nz) bool that see it on ``least`` of six sides.

    A voxel sees the surface on a side when a touched one lies that way along the axis, at any
    distance.  Two passes over the grid: what a voxel sees is what its neighbour on that side does.
    """
    nx, ny, nz = touched.shape
    seen = np.zeros((nx, ny, nz), np.uint8)
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                bits = _LOW if touched[x, y, z] else 0
                if x > 0:
                    bits |= seen[x - 1, y, z] & 1
                if y > 0:
                    bits |= seen[x, y - 1, z] & 2
                if z > 0:
                    bits |= seen[x, y, z - 1] & 4
                seen[x, y, z] = bits
    count = 0
    for x in range(nx - 1, -1, -1):
        for y in range(ny - 1, -1, -1):
            for z in range(nz - 1, -1, -1):
                bits = seen[x, y, z]
                if touched[x, y, z]:
                    bits |= _HIGH
                if x + 1 < nx:
                    bits |= seen[x + 1, y, z] & 8
                if y + 1 < ny:
                    bits |= seen[x, y + 1, z] & 16
                if z + 1 < nz:
                    bits |= seen[x, y, z + 1] & 32
                seen[x, y, z] = bits
                if not touched[x, y, z] and popcount(np.uint64(bits)) >= least:
                    count += 1
    return count
