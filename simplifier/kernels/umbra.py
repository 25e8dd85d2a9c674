"""The umbra of a view cell as heights over a raster, and what reaches out of it.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000), section
5: the union of the occluders' shadows by the maximum, the intersection over the samples by the
minimum.  The rays are those of ``cull_map.py``, followed to the border of the raster.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.cull_map import BLOCK, is_free

_ROUNDING = 1e-9  # of a height: what rounding may cost is seen


@kernel("float64[:], int64, uint16[:, :, :, :], int64[:, :], float64[:, :]")
def lower_umbra(sample, ring, solid, free, umbra):
    """Lower ``umbra`` (nx, ny) float64 to the shadows that are seen from a piece of edge, as codes.

    ``sample``  (6,) float64, in the raster, ``solid`` and ``free`` as ``see_from`` of
                ``cull_map.py`` takes them; ``ring`` half a side of the ring, past all pixels.

    A pixel gets the least height of the rays that visit it, minus infinite where one of them has
    passed no occluder; and where the sample is, as no ray has made a step there yet.
    """
    px, py = sample[0], sample[1]
    ix, iy = np.int64(np.floor(px)), np.int64(np.floor(py))
    if 0 <= ix < umbra.shape[0] and 0 <= iy < umbra.shape[1]:
        umbra[ix, iy] = -np.inf
    for side in range(4):
        for index in range(-ring, ring + 1):
            _lower_along(side, index / ring, ring, px, py, sample[2], solid, free, umbra)


@inner_kernel
def _lower_along(side, slant, ring, px, py, eye, solid, free, umbra):
    """Follow a ray; ``side`` 0 to 3: towards +x, -x, +y, -y."""
    x_major = side < 2
    nx, ny = umbra.shape
    along, across = (nx, ny) if x_major else (ny, nx)
    sign = 1 if side % 2 == 0 else -1
    begin = np.int64(np.floor(px if x_major else py))
    offset = py if x_major else px
    steepest = -np.inf
    shadow = -np.inf
    for step in range(1, ring + 1):
        major, minor = begin + sign * step, np.int64(np.floor(offset + slant * step))
        if major < 0 or minor < 0 or major >= along or minor >= across:
            return
        shadow += steepest
        x, y = (major, minor) if x_major else (minor, major)
        umbra[x, y] = min(umbra[x, y], eye + shadow)
        height = solid[x // BLOCK, y // BLOCK, x % BLOCK, y % BLOCK]
        if height > 0 and height - eye > shadow and not is_free(free, x, y):
            shadow = height - eye
            steepest = shadow / step


@kernel("float64[:, :], int64, int64, int64, int32[:], int32[:], float32[:], bool[:]")
def see_over(umbra, first_x, first_y, ny, starts, objects, tops, seen):
    """Set ``seen`` (n,) bool for what reaches out of an umbra in any pixel that it touches.

    ``umbra``   (kx, ky) float64, of a window that lies in the raster with its first pixel at
                ``first_x``, ``first_y``; ``ny`` pixels of the raster along y.
    ``starts``, ``objects``, ``tops``  what touches each pixel, as a height field has it.
    """
    for x in range(umbra.shape[0]):
        for y in range(umbra.shape[1]):
            place = (first_x + x) * ny + first_y + y
            for item in range(starts[place], starts[place + 1]):
                if tops[item] > umbra[x, y] - _ROUNDING:
                    seen[objects[item]] = True
