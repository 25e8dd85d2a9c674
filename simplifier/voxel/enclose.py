"""VoxelGrid -> VoxelGrid: what is inside, and what each remedy added to it."""

from __future__ import annotations

from simplifier.geometry.grid import VoxelGrid
from simplifier.geometry.solid import Closing
from simplifier.voxel.fill import Side, fill
from simplifier.voxel.holes import close_holes


def enclose(
    touched: VoxelGrid, closed_sides: frozenset[Side], smallest_hole: float
) -> tuple[VoxelGrid, tuple[Closing, ...]]:
    """Fill, then close the ground, then the holes; each adds to what the one before has found.

    ``closed_sides``   sides of the grid that are ground, may be empty.
    ``smallest_hole``  voxels, 0 for none; see :func:`~simplifier.voxel.holes.close_holes`.
    """
    filled, closings = fill(touched), []
    if closed_sides:
        grounded = fill(touched, closed_sides)
        closings.append(Closing("ground", grounded.count - filled.count))
        filled = grounded
    if smallest_hole > 0.0:
        closed = close_holes(touched, smallest_hole, closed_sides)
        joined = filled.with_inside(filled.inside | closed.inside)
        closings.append(Closing("smallest_hole", joined.count - filled.count))
        filled = joined
    return filled, tuple(closings)
