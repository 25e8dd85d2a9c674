"""Let one vertex stand for all in its cell of a lattice; keep the triangles with three corners."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import kernel


@kernel
def gather_first(vertices, low, step, numbers, points, chosen):
    """Gather the first of ``vertices`` (n, 3) in each cell into ``points`` (n, 3); their number.

    Cells are cubes of edge ``step`` from the corner ``low`` (3,) on; ``numbers`` (cx, cy, cz) int32
    holds -1 for each at first.  ``chosen`` (n,) int32 tells the point of each vertex.
    """
    count = 0
    for index in range(len(vertices)):
        x = np.int64((vertices[index, 0] - low[0]) / step)
        y = np.int64((vertices[index, 1] - low[1]) / step)
        z = np.int64((vertices[index, 2] - low[2]) / step)
        number = numbers[x, y, z]
        if number < 0:
            number = count
            numbers[x, y, z] = number
            for axis in range(3):
                points[number, axis] = vertices[index, axis]
            count += 1
        chosen[index] = number
    return count


@kernel
def keep_whole(faces, chosen, kept):
    """Write the ``faces`` (m, 3) int32 whose chosen corners differ to ``kept``; their number."""
    count = 0
    for face in range(len(faces)):
        a, b, c = chosen[faces[face, 0]], chosen[faces[face, 1]], chosen[faces[face, 2]]
        if a != b and b != c and c != a:
            kept[count, 0], kept[count, 1], kept[count, 2] = a, b, c
            count += 1
    return count
