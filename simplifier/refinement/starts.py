"""Occluders to refine from that are not made of planar sections.

A decimated surface covers a solid from all sides where the budget is large; sections hide more with
few triangles.  Which is better is for the measure to say: the search refines from several.

TriangleMesh -> surface: one vertex a cell (Rossignac and Borrel, 1993).

TriangleMesh -> surface: equal positions are one vertex, and no face comes twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.room import Room
from simplifier.geometry.solid import VoxelGrid
from simplifier.kernels.thin import crack_triangles, has_border
from simplifier.refinement.decimate import decimate_into
from simplifier.refinement.inner_surface import inner_surface
from simplifier.refinement.reduce import reduce_to


def enclosed_start(room: Room, budget: int) -> tuple[FloatArray, IntArray]:
    """The solid's smoothed surface in at most ``budget`` triangles, for what encloses a volume.

    Returns vertices (n, 3) float64 in grid space and faces (m, 3) int32, m at most the budget and
    0 where the solid is nowhere thicker than a voxel.
    """
    vertices, faces = inner_surface(room.shares)
    return decimate_into(vertices - room.margin, faces, room, budget)


def sheet_start(
    mesh: TriangleMesh, filled: VoxelGrid, room: Room, budget: int
) -> tuple[FloatArray, IntArray]:
    """The mesh itself in at most ``budget`` triangles, for open sheets and thin parts.

    Arguments and result as for :func:`enclosed_start`; ``mesh`` in world units.  Small components
    are given up first.
    """
    return decimate_into(*cluster_vertices(mesh, filled), room, budget)


def fine_starts(
    mesh: TriangleMesh, filled: VoxelGrid, rooms: Sequence[Room], budget: int
) -> list[tuple[FloatArray, IntArray]]:
    """The mesh itself in at most ``budget`` triangles, thinner than a voxel as it may be, by room.

    Arguments and results as for :func:`sheet_start`, whose cells leave nothing of a thin rod, or a
    ribbon that is too wide.
    """
    vertices, faces = weld_vertices(reduce_to(mesh, _MOST_FINE), filled)
    return [decimate_into(vertices, faces, room, budget) for room in rooms]


_MOST_FINE = 20_000  # triangles that take a tenth of a second


_CELLS = 64  # along the longest edge, at most: what is finer only costs time


def cluster_vertices(mesh: TriangleMesh, grid: VoxelGrid) -> tuple[FloatArray, IntArray]:
    """The mesh with all vertices in a cell moved to their mean; grid space.

    Cells are voxels, or cubes of several in grids of more than 64 a side.  Returns ``vertices``
    (n, 3) float64, each within a cell's diagonal of the vertices that it stands for, and ``faces``
    (m, 3) int32 in the order of the input: those that keep three different vertices, once each.
    Cracks that open at T-junctions are filled by more faces behind them.
    """
    size = max(1.0, max(grid.shape) / _CELLS)
    shape = np.ceil(np.array(grid.shape) / size).astype(np.int64)
    keys = np.zeros(len(mesh.vertices), dtype=np.int64)
    for axis in range(3):
        keys *= shape[axis]
        keys += np.clip((_column(mesh, grid, axis) / size).astype(np.int64), 0, shape[axis] - 1)
    total = int(shape.prod())
    counts = np.bincount(keys, minlength=total)
    used = counts > 0
    sums = [np.bincount(keys, _column(mesh, grid, axis), total)[used] for axis in range(3)]
    place = (np.cumsum(used) - 1)[keys].astype(np.int32)
    vertices = np.stack(sums, axis=1) / counts[used][:, None]
    faces = _distinct(place[mesh.faces], len(vertices))
    if has_border(faces):
        within = np.stack([_column(mesh, grid, axis) / size for axis in range(3)], axis=1)
        # What rounding puts past the grid belongs to its last cells.
        np.clip(within, 0.0, np.nextafter(shape, 0.0), out=within)
        cracks = crack_triangles(within, mesh.faces, place)
        if len(cracks):
            faces = _distinct(np.concatenate([faces, place[cracks]]), len(vertices))
    return vertices, faces


def _column(mesh: TriangleMesh, grid: VoxelGrid, axis: int) -> FloatArray:
    """(n,) one coordinate in grid space: all three at once would take three times the room."""
    return np.asarray((mesh.vertices[:, axis] - grid.origin[axis]) / grid.cell_size)


def _distinct(faces: IntArray, vertices: int) -> IntArray:
    a, b, c = faces.T
    kept = faces[(a != b) & (b != c) & (c != a)]
    low, middle, high = np.sort(kept, axis=1).astype(np.int64).T
    # At most 64**3 vertices: three of them fit into 64 bits.
    _, first = np.unique((low * vertices + middle) * vertices + high, return_index=True)
    return np.ascontiguousarray(kept[np.sort(first)])


def weld_vertices(mesh: TriangleMesh, grid: VoxelGrid) -> tuple[FloatArray, IntArray]:
    """``vertices`` (n, 3) float64 in grid space and ``faces`` (m, 3) int32 in the input's order.

    Exact, unlike :func:`~.clustering.clustered`: only what coincides is joined.
    """
    points, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = place.reshape(-1).astype(np.int32)[mesh.faces]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return grid.to_grid(points), np.ascontiguousarray(faces[np.sort(first)])
