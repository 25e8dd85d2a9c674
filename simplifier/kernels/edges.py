"""The edges of a mesh, by their lower ends."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel


@inner_kernel
def list_edges(faces, starts):
    """(3 m, 2) int32: the higher end of each edge, and its face, turned over (``~``) where the edge
    runs down.  Those of lower end i are the rows ``starts[i] : starts[i + 1]``, as faces come.

    ``faces``   (m, 3) int32.
    ``starts``  (n + 2,) int32, zeros: overwritten.
    """
    for face in range(len(faces)):
        for k in range(3):
            starts[min(faces[face, k], faces[face, (k + 1) % 3]) + 2] += 1
    for place in range(2, len(starts)):
        starts[place] += starts[place - 1]
    listed = np.empty((3 * len(faces), 2), np.int32)
    for face in range(len(faces)):
        for k in range(3):
            a, b = faces[face, k], faces[face, (k + 1) % 3]
            row = starts[min(a, b) + 1]
            listed[row, 0], listed[row, 1] = max(a, b), face if a < b else ~face
            starts[min(a, b) + 1] += 1
    return listed
