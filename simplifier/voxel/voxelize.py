"""TriangleMesh -> VoxelGrid: the voxels that the triangles touch (section 4.1 of the paper)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    low, high = mesh.bounds
    cells, cell_size = _fitted(high - low, resolution)
    origin = low - (cells * cell_size - (high - low)) / 2.0
    scale = 1.0 / cell_size
    touched = np.zeros(tuple(cells), dtype=np.bool_)
    run_chunks(
        lambda begin, end: mark_triangles(
            mesh.vertices, mesh.faces, origin, scale, begin, end, touched
        ),
        len(mesh.faces),
        least=_LEAST_TRIANGLES,
    )
    return VoxelGrid(touched, origin, cell_size)


def grid_shape(extent: FloatArray, resolution: int) -> tuple[int, int, int]:
    """Voxels along each axis of the grid of a mesh whose bounding box has those edges.

    Raises :class:`MeshError` as :func:`voxelize`.
    """
    nx, ny, nz = _fitted(extent, resolution)[0].tolist()
    return nx, ny, nz


def _fitted(extent: FloatArray, resolution: int) -> tuple[NDArray[np.int64], float]:
    """Voxels along each axis, and the edge of a voxel."""
    cell_size = float(extent.max()) / resolution
    if cell_size < _SMALLEST_CELL:
        raise MeshError(
            f"the mesh is {extent.max():g} units long, too small to divide into voxels",
            remedy="scale it up",
        )
    # An extent of 3.0000000001 cells is 3 cells and a rounding error, not 4.
    whole = np.ceil(extent / cell_size - 1e-9).astype(np.int64)
    return np.maximum(whole, 1), cell_size
