"""Add up the normals of triangles by their direction: a bin of it in the hemisphere above.

The upper half of an octahedron, seen from above and turned by an eighth, is a square of bins.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import kernel

_TINY = np.finfo(np.float64).tiny


@kernel("float64[:, :], int32[:, :], float64, int64, int64, int64, float64[:, :]")
def add_normals(vertices, faces, scale, bins, begin, end, totals):
    """Add what faces ``begin`` to ``end`` have, one after the other.

    ``vertices``  (n, 3) float64, times ``scale``; ``faces`` (m, 3) int32.
    ``totals``    (bins * bins, 4) float64: the normals as long as twice the areas, turned to the
                  hemisphere above, and their lengths.
    """
    for face in range(begin, end):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        px = scale * (vertices[b, 0] - vertices[a, 0])
        py = scale * (vertices[b, 1] - vertices[a, 1])
        pz = scale * (vertices[b, 2] - vertices[a, 2])
        qx = scale * (vertices[c, 0] - vertices[a, 0])
        qy = scale * (vertices[c, 1] - vertices[a, 1])
        qz = scale * (vertices[c, 2] - vertices[a, 2])
        nx, ny, nz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
        if nz < 0.0:
            nx, ny, nz = -nx, -ny, -nz
        whole = max(abs(nx) + abs(ny) + abs(nz), _TINY)
        x, y = nx / whole, ny / whole
        across = min(np.int64(0.5 * bins * (1.0 + (x + y))), bins - 1)
        along = min(np.int64(0.5 * bins * (1.0 + (x - y))), bins - 1)
        place = across * bins + along
        totals[place, 0] += nx
        totals[place, 1] += ny
        totals[place, 2] += nz
        totals[place, 3] += np.sqrt(nx * nx + ny * ny + nz * nz)
