"""Voxels wholly inside, and those that stay inside for viewers who move.

P. Wonka, M. Wimmer, D. Schmalstieg, "Visibility Preprocessing with Occluder Fusion for Urban
Walkthroughs" (2000); T. Yilmaz, U. Gudukbay, "Conservative occlusion culling for urban
visualization using a slice-wise data structure" (2007): an occluder every point of which is at
least a length inside the true solid hides, from all points within that length of a viewer, what it
hides from the viewer.

Regions to leave open -> the voxels that no triangle may touch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.overrides import Region
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.morphology import squared_distances
from simplifier.voxel.fill import Side

_SLACK = 1e-9  # shares and voxels that rounding may take


def core(
    touched: VoxelGrid,
    filled: VoxelGrid,
    shrink: float,
    lowest: FloatArray,
    closed_sides: frozenset[Side],
) -> VoxelGrid:
    """The enclosed voxels that are at least ``shrink`` voxels from all that is not enclosed.

    ``touched``, ``filled``  two solids of one grid; enclosed is what is in the second alone.
    ``shrink``        voxels, 0 or more: the least distance of any point of a voxel of the result
                      from any point of a voxel that is not enclosed.  Free space begins behind
                      the sides of the grid, solid ground behind the closed ones.
    ``lowest``        (3,) the mesh's low corner in grid space: a voxel that reaches below it at a
                      closed side is not wholly inside.
    ``closed_sides``  as in :func:`~simplifier.voxel.fill.fill`; low ends only.
    """
    enclosed = (filled.bits - touched.bits).voxels
    if shrink > 0.0:
        radius = min(shrink, float(sum(touched.shape)))  # no voxel is deeper; squares stay finite
        least = math.ceil(4.0 * radius * radius * (1.0 - _SLACK))  # in half voxels
        enclosed &= _squared_depths(enclosed, closed_sides) >= least
    for axis, _ in closed_sides:
        if lowest[axis] > _SLACK:
            enclosed[(slice(None),) * axis + (0,)] = False
    return touched.with_inside(enclosed)


def deepest(touched: VoxelGrid, filled: VoxelGrid, closed_sides: frozenset[Side]) -> float:
    """The largest ``shrink``, voxels, that leaves :func:`core` a voxel; 0 when none is enclosed."""
    enclosed = (filled.bits - touched.bits).voxels
    depths = _squared_depths(enclosed, closed_sides)[enclosed]
    return math.sqrt(float(depths.max(initial=0))) / 2.0


def _squared_depths(enclosed: BoolArray, closed_sides: frozenset[Side]) -> NDArray[np.int32]:
    """Squared distance of each voxel, all of it, to all that is not enclosed, in half voxels."""
    solid = np.pad(enclosed, 1)
    for axis, _ in closed_sides:
        solid[(slice(None),) * axis + (0,)] = True
    return squared_distances(~solid, 2)[1:-1, 1:-1, 1:-1]


SLACK = 1e-3
"""Voxels that a barred voxel may be away from its region: formats that round to 32 bits move
corners, and must not move them into it."""


def barred_voxels(grid: VoxelGrid, regions: Sequence[Region], margin: int = 0) -> BoolArray:
    """(nx + 2 m, ny + 2 m, nz + 2 m): the voxels, ``margin`` m layers about the grid included, that
    come within :data:`SLACK` of a region.
    """
    closed = np.zeros([length + 2 * margin for length in grid.shape], dtype=np.bool_)
    half = grid.cell_size * (0.5 + SLACK)
    for region in regions:
        reach = np.abs(region.axes).T @ region.half
        ends = grid.to_grid(np.stack([region.centre - reach, region.centre + reach])) + margin
        low = np.clip(np.floor(ends[0]) - 1, 0, closed.shape).astype(np.int64)
        high = np.clip(np.ceil(ends[1]) + 1, 0, closed.shape).astype(np.int64)
        for layer in range(low[0], high[0]):  # one at a time, for the memory of fine grids
            near = closed[layer, low[1] : high[1], low[2] : high[2]]
            rows, columns = np.indices(near.shape).reshape(2, -1)
            places = np.stack([np.full(len(rows), layer), rows + low[1], columns + low[2]], axis=1)
            centres = grid.to_world(places + (0.5 - margin))
            near |= region.meets_boxes(centres, half).reshape(near.shape)
    return closed


def open_regions(grid: VoxelGrid, regions: Sequence[Region]) -> VoxelGrid:
    """The solid without its barred voxels."""
    return grid.with_inside(grid.inside & ~barred_voxels(grid, regions)) if regions else grid
