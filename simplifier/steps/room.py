"""TriangleMesh, Solid -> Room: where the triangles of the occluder may be."""

from __future__ import annotations

from dataclasses import replace

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.room import INTERIOR, WHOLE, Room
from simplifier.geometry.solid import Solid, VoxelGrid
from simplifier.options.simplify import LITTLE_OVERHANG
from simplifier.options.stages import (
    ERROR_VOXELS,
    TOUCHED_VOXELS,
    Options,
    fineness,
)
from simplifier.voxel.morphology import with_neighbours
from simplifier.voxel.room import coarse_room, make_room
from simplifier.voxel.slab import thin_slab

_ROUNDING = 1e-9  # of a bound that a resolution was chosen for
_SPAN = 0.04  # of overhang, over which the room grows from one diagonal of a cell to nearly two


def open_room(
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    overrides: Overrides = NO_OVERRIDES,
) -> Room | None:
    """All that keeps the error bound, and regions open, in the slab of a thin mesh; None where what
    is cut stays as it is."""
    room = _bounded_room(mesh, solid, options, overrides)
    return None if room is None else replace(room, slab=thin_slab(mesh, solid.core, room.margin))


def _bounded_room(
    mesh: TriangleMesh, solid: Solid, options: Options, overrides: Overrides
) -> Room | None:
    """In voxels finer than the solid's own where that serves: overhang is to be small, which those
    do not resolve, or triangles keep wholly inside, where a shell of coarse ones would be given up,
    or an error bound was asked for.
    """
    regions = [one.region for one in overrides.open]
    if solid.reach > 0 and not regions:
        if options.refine.moves == 0:
            return None
        if options.fine_room:
            return _fine_room(mesh, solid, options)
    # What is cut from the core and stays as it is keeps to the core.
    moves = options.refine.moves > 0
    if solid.wholly_inside and moves and options.solid.shrink == 0.0 and not regions:
        return make_room(mesh, solid, fineness(options.solid.resolution, inside=True))
    bound, reach = 0.0 if solid.wholly_inside else ERROR_VOXELS, solid.reach
    if options.error_bound is not None and bound * solid.core.cell_size > options.error_bound:
        bound, reach = TOUCHED_VOXELS, 0
    return coarse_room(solid.core, reach, bound, regions)


def _fine_room(mesh: TriangleMesh, solid: Solid, options: Options) -> Room:
    """A cell's diagonal around the solid, or as far as overhang and error bound allow; around a
    sheet as far as the error bound does.

    Past that one the bound counts from what is inside in voxels of the room.  A sheet has next to
    nothing inside, so that is its surface: voxels that this touches are known in the room's own.
    """
    size, cell = fineness(options.solid.resolution), solid.core.cell_size
    share = _share_past_diagonal(solid, options)
    room = make_room(mesh, solid, size, TOUCHED_VOXELS * (1.0 + share * (1.0 - 1.0 / size)))
    if not (options.bound_from_fine_interior or solid.is_sheet):
        return room
    bound = ERROR_VOXELS if options.error_bound is None else options.error_bound / cell
    return replace(room, slack=0.0).within(min(bound, ERROR_VOXELS) * (1.0 + _ROUNDING))


def _share_past_diagonal(solid: Solid, options: Options) -> float:
    """0 to 1, of what an error bound that counts from fine voxels lets a room have."""
    if solid.is_sheet:
        return 1.0
    return min(max((options.refine.overhang - LITTLE_OVERHANG) / _SPAN, 0.0), 1.0)


def with_inner(solid: Solid, room: Room | None) -> Solid:
    """With the interior in the voxels of the room, where triangles keep to it or a bound counts;
    and without what the room was made of."""
    solid = replace(solid, finer=None)
    if room is None or room.layers.shape == room.shape:
        return solid
    if not solid.wholly_inside and room.slack > 0.0:
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
