"""Which levels of detail to make: a resolution and a budget each (paper section 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from simplifier.geometry.camera import Lens
from simplifier.geometry.occluder import LeftOut
from simplifier.options.simplify import LodOptions, check_outside
from simplifier.options.stages import Options, resolution_for

LEAST_VOXELS = 4
"""Resolution of the coarsest level by number: below it the bound is longer than the mesh."""

LEAST_BUDGET = 4
"""Triangles that every level may have: two crossing squares."""


@dataclass(frozen=True)
class LodPlan:
    """The levels to make, finest first.

    ``levels``       options of each, at least one, resolutions falling.
    ``lens``, ``pixel_error``  how they are looked at.
    ``left_out``     those that need not be tried.
    """

    levels: tuple[Options, ...]
    lens: Lens
    pixel_error: float
    left_out: tuple[LeftOut, ...]


def plan_levels(longest_edge: float, finest: Options, lods: LodOptions, drawn: int = 0) -> LodPlan:
    """The levels from the options of the finest one.

    No level's budget falls below the ``drawn`` triangles that all of them have.
    ``longest_edge`` of the mesh's bounding box, world units.  Raises
    :class:`~simplifier.errors.OptionError` for occluders that keep wholly inside: none of their
    levels has an error to be chosen by.
    """
    check_outside(finest.solid.wholly_inside)
    least = min(max(LEAST_BUDGET, drawn), finest.selection.budget)
    if lods.error_bounds is not None:
        grids, left_out = _by_bounds(longest_edge, finest, least, lods.error_bounds)
    else:
        grids, left_out = _by_halves(finest, least, lods.lods or 1)
    levels = tuple(
        replace(
            finest,
            solid=replace(finest.solid, resolution=resolution),
            selection=replace(finest.selection, budget=budget),
            # From as much further away a pixel beside the outline is as much more of the mesh.
            refine=replace(
                finest.refine,
                overhang=min(finest.refine.overhang * grids[0][0] / resolution, 1.0),
            ),
        )
        for resolution, budget in grids
    )
    lens = Lens(lods.screen_height, lods.fov)
    return LodPlan(levels, lens, lods.pixel_error, tuple(left_out))


_Grids = list[tuple[int, int]]  # resolution and budget


def _by_halves(finest: Options, least: int, count: int) -> tuple[_Grids, list[LeftOut]]:
    resolution, budget = finest.solid.resolution, finest.selection.budget
    grids, left_out = [(resolution, budget)], []
    for _ in range(1, count):
        resolution //= 2
        if resolution < LEAST_VOXELS:
            reason = f"fewer than {LEAST_VOXELS} voxels: the error would be longer than the mesh"
            left_out.append(LeftOut(max(resolution, 1), reason))
            continue
        budget = max(budget // 2, least)
        grids.append((resolution, budget))
    return grids, left_out


def _by_bounds(
    longest_edge: float, finest: Options, least: int, bounds: Sequence[float]
) -> tuple[_Grids, list[LeftOut]]:
    grids: _Grids = []
    left_out = []
    for bound in bounds:
        resolution = resolution_for(bound, longest_edge, "error bounds")
        if grids and resolution == grids[-1][0]:
            reason = f"an error bound of {bound:.6g} takes the same grid as the level before"
            left_out.append(LeftOut(resolution, reason))
            continue
        share = resolution / (grids[0][0] if grids else resolution)
        grids.append((resolution, max(round(finest.selection.budget * share), least)))
    return grids, left_out
