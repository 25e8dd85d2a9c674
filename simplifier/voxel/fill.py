"""VoxelGrid -> VoxelGrid: what the outside cannot reach is inside (section 4.1 of the paper).

VoxelGrid -> VoxelGrid: what is inside, and what each remedy added to it.

VoxelGrid -> VoxelGrid: what a ball of the smallest hole's width cannot sweep is inside.

The closing of mathematical morphology (J. Serra, "Image Analysis and Mathematical Morphology",
1982) with a flood fill between its two steps, in Euclidean distance.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.solid import BoolArray, Closing, VoxelGrid
from simplifier.kernels.fill import flood
from simplifier.kernels.morphology import squared_distances

Side = tuple[int, int]
"""(axis 0 to 2, 0 for the low or -1 for the high end)."""


def fill(touched: VoxelGrid, closed_sides: frozenset[Side] = frozenset()) -> VoxelGrid:
    """Add the free voxels that no open side of the grid can reach in steps across faces.

    ``touched``       the voxels that the surface touches.
    ``closed_sides``  sides of the grid that the outside does not enter from: the ground that the
                      asset stands on.

    The 6-connected components of the free voxels that reach an open side are outside; all else is
    inside.
    """
    free = ~touched.bits
    reached = _seeds(free, closed_sides)
    flood(free.words, reached.words)
    return touched.with_inside(~reached)


def _seeds(free: BitGrid, closed_sides: frozenset[Side]) -> BitGrid:
    seeds = BitGrid.empty(free.shape)
    for axis, end in product(range(3), (0, -1)):
        if (axis, end) in closed_sides:
            continue
        if axis < 2:
            border = (slice(None),) * axis + (end,)
            seeds.words[border] = free.words[border]
        else:
            word, bit = divmod(end % free.depth, 64)
            seeds.words[:, :, word] |= free.words[:, :, word] & (np.uint64(1) << np.uint64(bit))
    return seeds


def enclose(
    touched: VoxelGrid, closed_sides: frozenset[Side], smallest_hole: float
) -> tuple[VoxelGrid, tuple[Closing, ...]]:
    """Fill, then close the ground, then the holes; each adds to what the one before has found.

    ``closed_sides``   sides of the grid that are ground, may be empty.
    ``smallest_hole``  voxels, 0 for none; see :func:`~simplifier.voxel.fill.close_holes`.
    """
    filled, closings = fill(touched), []
    if closed_sides:
        grounded = fill(touched, closed_sides)
        closings.append(Closing("ground", grounded.count - filled.count))
        filled = grounded
    if smallest_hole > 0.0:
        closed = close_holes(touched, smallest_hole, closed_sides)
        joined = filled.with_inside(filled.bits | closed.bits)
        closings.append(Closing("smallest_hole", joined.count - filled.count))
        filled = joined
    return filled, tuple(closings)


OPEN_ABOVE = 3.0 * math.sqrt(3.0) + 1.0
"""Voxels: an opening wider than the smallest hole by this much stays open, however it lies.  On
either side a point in it is at most half a diagonal from its voxel's centre, a point of the surface
at most a diagonal from the nearest one of its voxel; one voxel more for the steps of the fill."""

_SLACK = 1e-6  # of the squared width in voxels: rounding must not open what is exactly as wide


def close_holes(
    touched: VoxelGrid, width: float, closed_sides: frozenset[Side] = frozenset()
) -> VoxelGrid:
    """Add the free voxels that no ball of diameter ``width`` coming from outside can sweep.

    ``touched``       the voxels that the surface touches.
    ``width``         the smallest hole, voxels, above 0.
    ``closed_sides``  as in :func:`~simplifier.voxel.fill.fill`; solid ground begins right behind
                      them, so a gap between the surface and the ground is an opening too.

    Let a *place* be a point that the centre of a ball of diameter ``width`` can come to from
    outside, on a way on which the ball never touches the surface.  Promised for any surface in
    any position, lengths in voxels:

    - narrower openings are closed: a voxel no point of which is within ``sqrt(width**2 + 1) / 2``
      of a place is in the result;
    - wider ones stay open: a voxel that holds a place of a ball of diameter ``width + OPEN_ABOVE``
      is not in the result (about 3 in place of ``OPEN_ABOVE`` for slots along the grid);
    - the result holds all touched voxels; the centre of any other of its voxels is within
      ``width / 2 + 0.5`` of a touched voxel or the ground, or cut off from the outside by voxels
      of which that is true.

    Why: the fill goes from centre to centre of voxels further than ``sqrt(width**2 + 1) / 2`` from
    all touched ones; half-way between two centres that leaves at least ``width / 2``.
    """
    limit = math.floor(width * width + 1.0 + _SLACK * max(1.0, width * width))  # in half voxels
    margin = math.ceil(math.sqrt(limit) / 2.0) + 2
    near = _within(_with_ground(touched, margin, closed_sides), limit)
    outside = ~fill(touched.with_inside(near), closed_sides).inside
    del near  # distances to the outside take most memory
    swept = _within(outside, limit)
    inner = (slice(margin, -margin),) * 3
    return touched.with_inside(np.ascontiguousarray(~swept[inner]))


def _within(sites: BoolArray, limit: int) -> BoolArray:
    """The voxels whose centre is so near to a site, in half voxels squared."""
    return np.asarray(squared_distances(sites, 1) <= limit)


def _with_ground(touched: VoxelGrid, margin: int, closed_sides: frozenset[Side]) -> BoolArray:
    """The voxels with free space around them, and ground behind the closed sides."""
    walls = np.pad(touched.inside, margin)
    for axis, end in closed_sides:
        ground = slice(None, margin) if end == 0 else slice(-margin, None)
        walls[tuple(ground if i == axis else slice(None) for i in range(3))] = True
    return walls
