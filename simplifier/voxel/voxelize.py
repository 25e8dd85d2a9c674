"""TriangleMesh -> VoxelGrid: the voxels that the triangles touch (section 4.1 of the paper)."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import VoxelGrid, cells_of
from simplifier.kernels.voxelize import mark_all_triangles


def voxelize(mesh: TriangleMesh, resolution: int) -> VoxelGrid:
    """Mark every voxel that a triangle touches, by an exact triangle/box test on closed sets.

    ``resolution`` (1 or more) is the number of voxels along the longest edge of the bounding box.
    Voxels are cubes; the other axes get as many as they need, at least one, and the box is centred
    in the grid: a flat asset costs a flat grid and lies in the middle of its voxels.

    A triangle within 1e-9 of a voxel counts as touching it, so a face that lies exactly between
    two voxels marks both, whatever the rounding.  Raises :class:`MeshError` for a mesh smaller
    than 1e-290 world units a voxel.
    """
    low, high = mesh.bounds
    cells, cell_size = cells_of(high - low, resolution)
    origin = low - (cells * cell_size - (high - low)) / 2.0
    scale = 1.0 / cell_size
    touched = np.zeros(tuple(cells), dtype=np.bool_)
    mark_all_triangles(mesh.vertices, mesh.faces, origin, scale, touched)
    return VoxelGrid(touched, origin, cell_size)
