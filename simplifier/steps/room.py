"""TriangleMesh, Solid -> Room: where the triangles of the occluder may be."""

from __future__ import annotations

from dataclasses import replace

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.room import INTERIOR, WHOLE, Room, fineness
from simplifier.geometry.solid import Solid, VoxelGrid
from simplifier.options.stages import ERROR_VOXELS, Options
from simplifier.voxel.morphology import with_neighbours
from simplifier.voxel.room import coarse_room, make_room


def open_room(
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    overrides: Overrides = NO_OVERRIDES,
) -> Room | None:
    """All that keeps the error bound, and regions open; None where what is cut stays as it is.

    In voxels finer than the solid's own where that serves: overhang is to be small, which those do
    not resolve, or triangles keep wholly inside, where a shell of coarse ones would be given up.
    """
    regions = [one.region for one in overrides.open]
    shape = solid.touched.shape
    if solid.reach > 0 and not regions:
        if options.refine.moves == 0:
            return None
        if options.refine.overhang < 1.0:
            return make_room(mesh, solid, fineness(shape))
    # What is cut from the core and stays as it is keeps to the core.
    moves = options.refine.moves > 0
    if solid.wholly_inside and moves and options.solid.shrink == 0.0 and not regions:
        return make_room(mesh, solid, fineness(shape, inside=True))
    bound = 0.0 if solid.wholly_inside else ERROR_VOXELS
    return coarse_room(solid.core, solid.reach, bound, regions)


def with_inner(solid: Solid, room: Room | None) -> Solid:
    """With the interior in the voxels of the room that triangles of it keep to."""
    if room is None or not solid.wholly_inside or room.layers.shape == room.shape:
        return solid
    size = room.layers.shape[0] // room.shape[0]
    around = int(room.margin) * size
    inside = room.layers[around:-around, around:-around, around:-around] == INTERIOR
    return replace(solid, inner=VoxelGrid(inside, solid.core.origin, solid.core.cell_size / size))


def solid_to_cut(solid: Solid, room: Room | None) -> Solid:
    """The solid with a core that is no thicker than the mesh, for sections that stay in the room.

    Cells that the surface touches reach past it by half of one in the mean, which triangles in a
    fine room would lose again by shrinking.  So those count that are inside by half, and those of
    parts too thin to fill half of any.
    """
    if room is None or room.layers.shape == room.shape:
        return solid
    margin = int(room.margin)
    shares = room.shares[margin:-margin, margin:-margin, margin:-margin]
    filled = shares >= WHOLE // 2
    thin = solid.core.inside & ~with_neighbours(filled)
    return replace(solid, core=solid.core.with_inside(filled | thin))
