"""TriangleMesh -> VoxelGrid: the voxels that the triangles touch (section 4.1 of the paper)."""

from __future__ import annotations

import numpy as np

from simplifier.errors import MeshError
from simplifier.geometry.grid import VoxelGrid
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.voxels import mark_triangles

_LEAST_TRIANGLES = 4096  # fewer are not worth a hand-over to another thread
_SMALLEST_CELL = 1e-290  # world units; below, float64 loses digits and its reciprocal overflows


def voxelize(mesh: TriangleMesh, resolution: int) -> VoxelGrid:
    """Mark every voxel that a triangle touches, by an exact triangle/box test on closed sets.

    ``resolution`` (1 or more) is the number of voxels along the longest edge of the bounding box.
    Voxels are cubes; the other axes get as many as they need, at least one, and the box is centred
    in the grid: a flat asset costs a flat grid and lies in the middle of its voxels.

    A triangle within 1e-9 of a voxel counts as touching it, so a face that lies exactly between
    two voxels marks both, whatever the rounding.  Raises :class:`MeshError` for a mesh smaller
    than 1e-290 world units a voxel.
    """
    grid = _empty_grid(mesh, resolution)
    scale = 1.0 / grid.cell_size
    touched = np.zeros(grid.shape, dtype=np.bool_)
    run_chunks(
        lambda begin, end: mark_triangles(
            mesh.vertices, mesh.faces, grid.origin, scale, begin, end, touched
        ),
        len(mesh.faces),
        least=_LEAST_TRIANGLES,
    )
    return grid.with_inside(touched)


def _empty_grid(mesh: TriangleMesh, resolution: int) -> VoxelGrid:
    low, high = mesh.bounds
    extent = high - low
    cell_size = float(extent.max()) / resolution
    if cell_size < _SMALLEST_CELL:
        raise MeshError(
            f"the mesh is {extent.max():g} units long, too small to divide into voxels",
            remedy="scale it up",
        )
    cells = _cells(extent, cell_size)
    origin = low - (cells * cell_size - extent) / 2.0
    return VoxelGrid(np.zeros(tuple(cells), dtype=np.bool_), origin, cell_size)


def _cells(extent: FloatArray, cell_size: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    # An extent of 3.0000000001 cells is 3 cells and a rounding error, not 4.
    whole = np.ceil(extent / cell_size - 1e-9).astype(np.int64)
    return np.maximum(whole, 1)
