"""Voxels -> voxels: distances between them, and solids grown by whole voxels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.morphology import FAR, spread_rows
from simplifier.kernels.threads import run_chunks

_LEAST_ROWS = 64  # fewer are not worth a hand-over to another thread


def squared_distances(sites: BoolArray, edge: int) -> NDArray[np.int32]:
    """Squared Euclidean distance of every voxel to the nearest of ``sites``, exact.

    ``sites``  (nx, ny, nz) bool.
    ``edge``   0, 1 or 2: what a site is, a cube of that many voxels around its centre.  0 gives
               distances between centres, 1 from a centre to a voxel, 2 between voxels.

    Returns (nx, ny, nz) int32 squares of HALF voxels, all whole numbers; 2**30 where there is no
    site at all.
    """
    squares = np.where(sites, np.int32(0), np.int32(FAR))
    for axes in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
        _dilate_rows(squares.transpose(axes), edge)
    return squares


def _dilate_rows(planes: NDArray[np.int32], edge: int) -> None:
    """Along the last axis, in place: a turned copy would double the memory."""

    def work(begin: int, end: int) -> None:
        for place in range(begin, end):
            rows = np.ascontiguousarray(planes[place])
            spread_rows(rows, edge, 0, len(rows))
            planes[place] = rows

    run_chunks(work, len(planes), least=max(1, _LEAST_ROWS // planes.shape[1]))


def dilate(grid: VoxelGrid, reach: int) -> tuple[BoolArray, float]:
    """The solid and all voxels within ``reach`` of it, even across corners, in a larger array.

    Returns the (nx + 2 m, ny + 2 m, nz + 2 m) bool array and the margin m = ``reach`` + 1: a point
    p of grid space lies in voxel floor(p + m).  The outermost layer is never set.
    """
    margin = reach + 1
    grown = np.pad(grid.inside, margin)
    for _ in range(reach):
        grown = with_neighbours(grown)
    return grown, float(margin)


def with_neighbours(voxels: BoolArray) -> BoolArray:
    """Those that are set and all next to them, even across corners, in an array of that size."""
    for axis in range(3):
        # Growing along one axis after the other takes in all 26 neighbours.
        once = voxels.copy()
        ahead = tuple(slice(1, None) if i == axis else slice(None) for i in range(3))
        behind = tuple(slice(None, -1) if i == axis else slice(None) for i in range(3))
        once[ahead] |= voxels[behind]
        once[behind] |= voxels[ahead]
        voxels = once
    return voxels


def glue_neighbours(grid: VoxelGrid) -> VoxelGrid:
    """The solid and all voxels of the same grid next to it, even across corners."""
    return grid.with_inside(with_neighbours(grid.inside))
