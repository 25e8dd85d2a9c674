"""TriangleMesh -> VoxelGrid: the voxels that the triangles touch (section 4.1 of the paper)."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import VoxelGrid, cells_of
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.voxelize import mark_all_triangles, mark_cells


def voxelize(mesh: TriangleMesh, resolution: int) -> VoxelGrid:
    """Mark every voxel that a triangle touches, by an exact triangle/box test on closed sets.

    ``resolution`` (1 or more) is the number of voxels along the longest edge of the bounding box.
    Voxels are cubes; the other axes get as many as they need, at least one, and the box is centred
    in the grid: a flat asset costs a flat grid and lies in the middle of its voxels.

    A triangle within 1e-9 of a voxel counts as touching it, so a face that lies exactly between
    two voxels marks both, whatever the rounding.  Raises :class:`MeshError` for a mesh smaller
    than 1e-290 world units a voxel.
    """
    return voxelize_finely(mesh, resolution, 1)


def voxelize_finely(mesh: TriangleMesh, resolution: int, size: int) -> VoxelGrid:
    """As :func:`voxelize`, with ``size`` (1 or more) voxels along each axis in place of one."""
    low, high = mesh.bounds
    cells, cell_size = cells_of(high - low, resolution)
    origin = low - (cells * cell_size - (high - low)) / 2.0
    touched = np.zeros(tuple(size * cells), dtype=np.bool_)
    mark_all_triangles(mesh.vertices, mesh.faces, origin, size / cell_size, touched)
    return VoxelGrid(touched, origin, cell_size / size)


def merged(voxels: VoxelGrid, size: int) -> VoxelGrid:
    """A grid of which each voxel is ``size`` of these along each axis, touched where one of them
    is; the number of voxels along each axis is a multiple of ``size``."""
    cells = np.empty([length // size for length in voxels.shape], dtype=np.bool_)
    run_chunks(lambda begin, end: mark_cells(voxels.inside, begin, end, cells), len(cells))
    return VoxelGrid(cells, voxels.origin, voxels.cell_size * size)
