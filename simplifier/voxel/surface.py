"""VoxelGrid -> voxel mesh: the solid's boundary as triangles (section 4.1 of the paper)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import IntArray
from simplifier.geometry.solid import VoxelGrid

# Corners of the face between voxel p and its neighbour along an axis, relative to p, in the order
# that is counter-clockwise when seen from the neighbour.
_FACE = (
    np.array([[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]]),
    np.array([[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]]),
    np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]),
)


def voxel_mesh(grid: VoxelGrid) -> tuple[IntArray, IntArray]:
    """Two triangles for each face between an inside and an outside voxel, wound outwards.

    Returns ``vertices`` (n, 3) int32 lattice points in grid space and ``faces`` (m, 3) int32,
    counter-clockwise seen from outside.  The grid's border counts as outside.

    The mesh is closed and its signed volume is the number of inside voxels.  Every edge is used an
    even number of times, once in each direction by turns; an edge along which two voxels touch
    diagonally is used four times, so the mesh is a two-manifold everywhere but there.
    """
    solid = np.pad(grid.inside, 1)
    quads = [_faces_along(solid, axis, side) for axis in range(3) for side in (1, -1)]
    corners = np.concatenate(quads)
    lattice = np.array(grid.shape, dtype=np.int64) + 1
    keys = (corners[:, :, 0] * lattice[1] + corners[:, :, 1]) * lattice[2] + corners[:, :, 2]
    unique, indices = np.unique(keys, return_inverse=True)
    vertices = np.stack(np.unravel_index(unique, tuple(lattice)), axis=1).astype(np.int32)
    a, b, c, d = indices.reshape(-1, 4).T
    faces = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.int32)
    return vertices, faces


def _faces_along(solid: NDArray[np.bool_], axis: int, side: int) -> NDArray[np.int64]:
    """(q, 4, 3) lattice corners of the faces whose outside lies along +axis or -axis."""
    near = np.delete(solid, -1, axis=axis)
    far = np.delete(solid, 0, axis=axis)
    boundary = near & ~far if side > 0 else far & ~near
    # The padding shifts everything by one voxel.
    cells = np.argwhere(boundary) - 1
    ring = _FACE[axis] if side > 0 else _FACE[axis][::-1]
    return np.asarray(cells[:, None, :] + ring[None])
