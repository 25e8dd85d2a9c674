"""Which levels of detail to make: a resolution and a budget each (paper section 4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from simplifier.errors import OptionError
from simplifier.geometry.camera import Lens
from simplifier.geometry.lod_chain import LeftOut
from simplifier.options import LodOptions, Options, resolution_for

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


def typed_lods(
    lods: int | None,
    error_bounds: str | None,
    pixel_error: float | None,
    screen_height: int | None,
    fov: float | None,
) -> LodOptions | None:
    """The options as typed, ``error_bounds`` separated by commas; None for a single occluder.

    Raises :class:`~simplifier.errors.OptionError`, also where a screen is given for no levels.
    """
    screen = {"pixel error": pixel_error, "screen height": screen_height, "fov": fov}
    if lods is None and error_bounds is None:
        for name, value in screen.items():
            if value is not None:
                remedy = "give lods or error bounds as well"
                raise OptionError("only levels of detail have one", where=name, remedy=remedy)
        return None
    bounds = None if error_bounds is None else _lengths(error_bounds)
    return LodOptions(
        lods,
        bounds,
        1.0 if pixel_error is None else pixel_error,
        1080 if screen_height is None else screen_height,
        60.0 if fov is None else fov,
    )


def _lengths(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise OptionError(
            f"'{text}' is no list of lengths",
            where="error bounds",
            remedy="separate them by commas",
        ) from None


def finest_bound(
    lods: LodOptions, resolution: int | None, error_bound: float | None
) -> float | None:
    """The error bound of the finest level, None where a resolution says how fine it is.

    Raises :class:`~simplifier.errors.OptionError` when ``lods`` has error bounds and one of the
    other two is given as well.
    """
    if lods.error_bounds is None:
        return error_bound
    for name, value in (("a resolution", resolution), ("an error bound", error_bound)):
        if value is not None:
            raise OptionError(
                f"cannot be given together with {name}",
                where="error bounds",
                remedy="choose one of the two",
            )
    return lods.error_bounds[0]


def plan_levels(longest_edge: float, finest: Options, lods: LodOptions) -> LodPlan:
    """The levels from the options of the finest one.

    ``longest_edge`` of the mesh's bounding box, world units.  Raises
    :class:`~simplifier.errors.OptionError` for occluders that keep wholly inside: none of their
    levels has an error to be chosen by.
    """
    if finest.solid.wholly_inside:
        raise OptionError(
            "levels of detail cannot be kept wholly inside: their error bound is 0 at any distance",
            where="lods",
            remedy="leave out conservative and shrink, or make single occluders",
        )
    if lods.error_bounds is not None:
        grids, left_out = _by_bounds(longest_edge, finest, lods.error_bounds)
    else:
        grids, left_out = _by_halves(finest, lods.lods or 1)
    levels = tuple(
        replace(
            finest,
            solid=replace(finest.solid, resolution=resolution),
            selection=replace(finest.selection, budget=budget),
        )
        for resolution, budget in grids
    )
    lens = Lens(lods.screen_height, lods.fov)
    return LodPlan(levels, lens, lods.pixel_error, tuple(left_out))


_Grids = list[tuple[int, int]]  # resolution and budget


def _by_halves(finest: Options, count: int) -> tuple[_Grids, list[LeftOut]]:
    resolution, budget = finest.solid.resolution, finest.selection.budget
    grids, left_out = [(resolution, budget)], []
    for _ in range(1, count):
        resolution //= 2
        if resolution < LEAST_VOXELS:
            reason = f"fewer than {LEAST_VOXELS} voxels: the error would be longer than the mesh"
            left_out.append(LeftOut(max(resolution, 1), reason))
            continue
        budget = _at_least(budget // 2, finest)
        grids.append((resolution, budget))
    return grids, left_out


def _by_bounds(
    longest_edge: float, finest: Options, bounds: tuple[float, ...]
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
        grids.append((resolution, _at_least(round(finest.selection.budget * share), finest)))
    return grids, left_out


def _at_least(budget: int, finest: Options) -> int:
    return max(budget, min(LEAST_BUDGET, finest.selection.budget))
