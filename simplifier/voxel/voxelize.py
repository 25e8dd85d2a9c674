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
    return voxelize_finely(mesh, resolution, 1)[0]


def voxelize_finely(mesh: TriangleMesh, resolution: int, size: int) -> tuple[VoxelGrid, VoxelGrid]:
    """As :func:`voxelize`, in cells and in voxels, ``size`` (1 or more) of a cell along each axis.

    Triangles are marked in the voxels alone: a cell is touched where one of its voxels is.
    """
    low, high = mesh.bounds
    shape, cell_size = cells_of(high - low, resolution)
    origin = low - (shape * cell_size - (high - low)) / 2.0
    marks = np.zeros(tuple(size * shape), dtype=np.bool_)
    mark_all_triangles(mesh.vertices, mesh.faces, origin, size / cell_size, marks)
    voxels = VoxelGrid(marks, origin, cell_size / size)
    if size == 1:
        return voxels, voxels
    cells = np.empty(tuple(shape), dtype=np.bool_)
    run_chunks(lambda begin, end: mark_cells(marks, begin, end, cells), len(cells))
    return VoxelGrid(cells, origin, cell_size), voxels
