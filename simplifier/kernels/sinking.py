"""Sink the corners of triangles that leave a room to where there is more of it."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel


@kernel("float64[:, :], int32[:, :], bool[:], float64[:, :, :], float64, float64[:, :], float64")
def sink(points, faces, inside, depth, size, ways, step):
    """Move the corners of the faces that are not ``inside`` (m,) to where the ``depth`` rises.

    ``points``  (n, 3) float64, moved by a ``step`` each, ``faces`` (m, 3) int32.
    ``depth``   (nx, ny, nz) float64 at the centres of cells of a ``size`` in the points' units.
    ``ways``    (n, 3) float64: overwritten.

    A corner goes the way of all its faces, whose centres look a cell to either side along each
    axis.
    """
    ways[:] = 0.0
    centre = np.empty(3)
    slopes = np.empty((len(faces), 3))
    for face in range(len(faces)):
        if inside[face]:
            continue
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        for axis in range(3):
            middle = (points[a, axis] + points[b, axis] + points[c, axis]) / 3.0
            centre[axis] = middle / size - 0.5
        for axis in range(3):
            here = centre[axis]
            centre[axis] = here - 1.0
            low = read_between(depth, centre)
            centre[axis] = here + 1.0
            slopes[face, axis] = read_between(depth, centre) - low
            centre[axis] = here
    for k in range(3):
        for face in range(len(faces)):
            if not inside[face]:
                for axis in range(3):
                    ways[faces[face, k], axis] += slopes[face, axis]
    for index in range(len(points)):
        x, y, z = ways[index, 0], ways[index, 1], ways[index, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            for axis in range(3):
                points[index, axis] += step * (ways[index, axis] / length)


@inner_kernel
def read_between(field, point):
    """The value at a ``point`` (3,) by trilinear interpolation; cell (i, j, k) is at (i, j, k).

    Off the grid, that of the nearest point of it.
    """
    x, y, z = np.floor(point[0]), np.floor(point[1]), np.floor(point[2])
    i, j, k = np.int64(x), np.int64(y), np.int64(z)
    u, v, w = point[0] - x, point[1] - y, point[2] - z
    last_i, last_j, last_k = field.shape[0] - 1, field.shape[1] - 1, field.shape[2] - 1
    total = 0.0
    for di in range(2):
        a = min(max(i + di, 0), last_i)
        of_u = u if di == 1 else 1.0 - u
        for dj in range(2):
            b = min(max(j + dj, 0), last_j)
            of_v = v if dj == 1 else 1.0 - v
            for dk in range(2):
                c = min(max(k + dk, 0), last_k)
                of_w = w if dk == 1 else 1.0 - w
                total += field[a, b, c] * of_u * of_v * of_w
    return total
