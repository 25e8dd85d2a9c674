"""What a user can choose, a frozen dataclass a stage.

Every field has its unit, its range and what raising it does.  Defaults are safe.  A value out of
range raises :class:`~simplifier.errors.OptionError` when the options are made, so no stage checks
again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

from simplifier.checks import (
    check_flag,
    check_length,
    check_one_of,
    check_whole,
    check_within,
    is_finite,
    is_number,
    settle_numbers,
    value_text,
)
from simplifier.errors import OptionError

TOLERANCE_VOXELS = 1.0
"""How far Ramer-Douglas-Peucker may move an outline, in voxels (section 4.3: the voxel size)."""

ERROR_VOXELS = 2.0 * math.sqrt(3.0)
"""The error bound in voxels.  A refined triangle keeps to voxels that touch the solid, at most a
voxel's diagonal from one of it, and a touched voxel holds a point of the surface, at most another
diagonal away.  An outline that is not refined reaches less far: half a pixel's diagonal and the
tolerance past the solid."""

MOST_VOXELS = 1024
"""The finest grid, in voxels along the longest edge."""

MOST_MOVES = 100_000_000
"""The longest search."""

Slicing = Literal["cpu", "gl"]
Trim = Literal["gain", "area"]
Axis = Literal["x", "y", "z"]
Viewers = Literal["all", "above"]
Transparent = Literal["leave-out", "keep"]
Preset = Literal["draft", "balanced", "best"]


def _check_time(seconds: float) -> None:
    if not is_number(seconds) or not 0.0 < seconds <= LONGEST_SECONDS:
        raise OptionError(
            f"{seconds!r} is no time",
            where="time limit",
            remedy=f"give seconds, above 0 and at most {LONGEST_SECONDS:,.0f}",
        )


LONGEST_SECONDS = 1e6
"""The longest time limit, seconds: eleven days."""


@dataclass(frozen=True)
class SolidOptions:
    """What counts as inside."""

    resolution: int = 64
    """Voxels along the longest edge, 1 to 1024.  Raising it tightens the error bound; time and
    memory grow with its square to cube."""

    up: Axis = "y"
    """The asset's up axis; with ``ground`` its low end is the ground."""

    ground: bool = False
    """The asset stands on the ground: nothing enters from below, so an open base is closed."""

    smallest_hole: float = 0.0
    """World units, 0 or more: openings narrower than this count as closed; 0 closes none.  Raising
    it closes more, and shallow niches with it."""

    conservative: bool = False
    """Only voxels wholly inside count and the occluder keeps to them, so that a closed mesh is
    never covered past its edge.  Thin parts are lost."""

    shrink: float = 0.0
    """World units, 0 or more: the occluder keeps at least this far inside the solid, so that what
    it hides from a point it hides from all points within this length of it.  Above 0 it implies
    ``conservative``.  Raising it loses recall, and parts thinner than twice of it."""

    glue: bool = False
    """One dilation step (section 5): voxels next to a touched one count as touched, so neighbours
    grow together, and the occluder keeps to the solid in place of going a voxel past it: the error
    bound stays.  Nothing grows past the bounding box.  Without effect where all is wholly inside.
    """

    def __post_init__(self) -> None:
        settle_numbers(self)
        check_whole("resolution", self.resolution, 1, MOST_VOXELS)
        check_one_of("up", self.up, ("x", "y", "z"))
        check_length("smallest hole", self.smallest_hole)
        check_length("shrink", self.shrink)

    @property
    def wholly_inside(self) -> bool:
        """Whether the occluder keeps to voxels that are wholly inside."""
        return self.conservative or self.shrink > 0.0


@dataclass(frozen=True)
class SectionOptions:
    """Where the solid is cut."""

    directions: int = 128
    """Direction bins over a hemisphere, 1 to 4096, beside the three axes.  More bins find better
    planes; time grows in proportion."""

    direction_samples: int = 1
    """Directions tried in each bin, 1 to 64."""

    depths: int = 4
    """Depth bins a direction, 1 to 1024."""

    depth_step: float = 1.0
    """Distance of the planes tried in a depth bin, voxels, 0.1 to 64; less finds larger slices."""

    depth_samples: int = 32
    """Most planes tried in a depth bin, 1 to 1024.  Up to 128 voxels the step alone counts; past
    that this keeps the time from growing with the cube of the resolution."""

    slicer: Slicing = "cpu"
    """``cpu`` samples the grid; ``gl`` draws the voxel mesh into an OpenGL stencil buffer."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        check_whole("directions", self.directions, 1, 4096)
        check_whole("direction samples", self.direction_samples, 1, 64)
        check_whole("depths", self.depths, 1, 1024)
        check_within("depth step", self.depth_step, 0.1, 64.0)
        check_whole("depth samples", self.depth_samples, 1, 1024)
        check_one_of("slicer", self.slicer, ("cpu", "gl"))


@dataclass(frozen=True)
class SelectionOptions:
    """Which polygons make the occluder."""

    budget: int = 64
    """Most triangles of the occluder, 1 to 100,000."""

    alpha: float = 0.001
    """The cut is complete when another polygon would raise the occlusion measure by less than this
    share, 0 to 1."""

    trim: Trim = "gain"
    """How the budget is met: ``gain`` chooses polygons and levels by measure a triangle and
    improves them by exchange; ``area`` is the paper's trim by surface area."""

    views: int = 48
    """Directions that the occlusion measure is averaged over while searching, 1 to 4096."""

    exchanges: int = 8
    """How often two members of the cut are taken out and their triangles spent anew, 0 to 10,000;
    more gain little."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        check_whole("budget", self.budget, 1, 100_000)
        check_within("alpha", self.alpha, 0.0, 1.0)
        check_whole("search views", self.views, 1, 4096)
        check_whole("exchanges", self.exchanges, 0, 10_000)
        check_one_of("trim", self.trim, ("gain", "area"))


@dataclass(frozen=True)
class RefineOptions:
    """How the chosen triangles are improved."""

    moves: int = 26_400
    """Moves tried by each search, 0 to 100,000,000; 0 leaves the cut as it is.  More find better
    occluders; time grows in proportion."""

    searches: int = 2
    """Searches side by side, 1 to 64, that share the processors and go on from the best."""

    overcover: float = 0.5
    """What a measure that is hidden wrongly costs beside one hidden rightly, 0 to 100.  Raising it
    lifts precision and lowers recall."""

    precision: float = 0.995
    """Precision that the search aims for at least, 0 to 1: where its own views show less, it raises
    the cost of what is hidden wrongly."""

    views: int = 96
    """Directions that the search looks from, 1 to 4096."""

    decimated: bool = True
    """Begin a search from decimated surfaces too, and keep one as it is where that hides most."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        check_whole("moves", self.moves, 0, MOST_MOVES)
        check_whole("searches", self.searches, 1, 64)
        check_within("overcover", self.overcover, 0.0, 100.0)
        check_within("min precision", self.precision, 0.0, 1.0)
        check_whole("refine views", self.views, 1, 4096)


_FEW = 64  # triangles that a preset's moves are enough for
_MOST_MOVES = 8.0  # times as many for any number


@dataclass(frozen=True)
class Effort:
    """What a preset spends: sections and exchanges of the cut; moves, views, starts to refine."""

    sections: SectionOptions
    exchanges: int
    moves: int  # for few triangles
    views: int
    decimated: bool


PRESETS: dict[Preset, Effort] = {
    "draft": Effort(SectionOptions(directions=16, depths=3), 0, 8_400, 64, False),
    "balanced": Effort(SectionOptions(directions=32, depths=4), 0, 26_400, 96, True),
    "best": Effort(SectionOptions(directions=128, depths=4), 8, 115_200, 144, True),
}


@dataclass(frozen=True)
class Options:
    """All of a simplification."""

    solid: SolidOptions = field(default_factory=SolidOptions)
    sections: SectionOptions = field(default_factory=SectionOptions)
    selection: SelectionOptions = field(default_factory=SelectionOptions)
    refine: RefineOptions = field(default_factory=RefineOptions)
    viewers: Viewers = "all"
    """Where viewers can be: everywhere, or ``above``, looking level or downwards."""

    seed: int = 0
    """Seed of every random choice, 0 to 2**63 - 1."""

    time_limit: float | None = None
    """Seconds from mesh to occluder, above 0: less shortens the preset's work, more goes on
    refining, whatever the moves.  None takes as long as the preset's work does."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        check_one_of("viewers", self.viewers, ("all", "above"))
        check_whole("seed", self.seed, 0, 2**63 - 1)
        if self.time_limit is not None:
            _check_time(self.time_limit)


def make_options(
    longest_edge: float,
    *,
    budget: int = 64,
    resolution: int | None = None,
    error_bound: float | None = None,
    up: Axis = "y",
    ground: bool = False,
    viewers: Viewers = "all",
    smallest_hole: float = 0.0,
    conservative: bool = False,
    shrink: float = 0.0,
    trim: Trim = "gain",
    slicer: Slicing = "cpu",
    alpha: float = 0.001,
    preset: Preset = "balanced",
    min_precision: float = 0.995,
    moves: int | None = None,
    time_limit: float | None = None,
    seed: int = 0,
) -> Options:
    """The options of a simplification from the names that users type.

    ``preset`` says how much time to spend, and ``moves`` replaces its number of refining moves;
    with a ``time_limit``, seconds, refining lasts until then in place of moves.  It aims for
    ``min_precision`` at least.
    ``longest_edge`` of the mesh's bounding box, world units, turns ``error_bound`` into the least
    resolution that keeps it.  ``viewers`` above imply ``ground``, a ``shrink`` above 0 implies
    ``conservative``.  Raises :class:`~simplifier.errors.OptionError` when a value is out of range,
    resolution and error bound, or moves and time limit, are both given, or ``smallest_hole`` is
    longer than the mesh.
    """
    check_alternatives(resolution, error_bound, moves, time_limit)
    if error_bound is not None:
        resolution = resolution_for(error_bound, longest_edge)
    check_one_of("preset", preset, tuple(PRESETS))
    check_flag("ground", ground)
    check_flag("conservative", conservative)
    check_length("shrink", shrink)
    solid = SolidOptions(
        64 if resolution is None else resolution, up, ground or viewers == "above",
        smallest_hole, conservative or shrink > 0.0, shrink,
    )  # fmt: skip
    if smallest_hole > longest_edge:
        raise OptionError(
            f"{smallest_hole!r} is longer than the mesh",
            where="smallest hole",
            remedy=f"choose 0 to {longest_edge:.6g}",
        )
    effort = PRESETS[preset]
    return Options(
        solid=solid,
        sections=replace(effort.sections, slicer=slicer),
        selection=SelectionOptions(budget, alpha, trim, exchanges=effort.exchanges),
        refine=RefineOptions(
            _moves(effort, budget) if moves is None else moves,
            precision=min_precision,
            views=effort.views,
            decimated=effort.decimated,
        ),
        viewers=viewers,
        seed=seed,
        time_limit=time_limit,
    )


def check_alternatives(
    resolution: int | None,
    error_bound: float | None,
    moves: int | None,
    time_limit: float | None,
) -> None:
    """Refuse two answers to one question; raises :class:`~simplifier.errors.OptionError`."""
    for name, value, other, rival in (
        ("error bound", error_bound, "a resolution", resolution),
        ("time limit", time_limit, "moves", moves),
    ):
        if value is not None and rival is not None:
            raise OptionError(
                f"cannot be given together with {other}", where=name, remedy="choose one of the two"
            )


def _moves(effort: Effort, budget: int) -> int:
    """More for many triangles, though not in proportion: each needs some."""
    more = math.pow(max(budget / _FEW, 1.0), 0.75)
    return round(effort.moves * min(more, _MOST_MOVES))


def resolution_for(error_bound: float, longest_edge: float, where: str = "error bound") -> int:
    """The least resolution that keeps the bound; ``where`` names the option in messages.

    Raises :class:`~simplifier.errors.OptionError` for a bound that is no positive length or that
    would take more than :data:`MOST_VOXELS`.
    """
    if not is_finite(error_bound) or not error_bound > 0.0:
        raise OptionError(
            f"{value_text(error_bound)} is not a length",
            where=where,
            remedy="give a positive length in the units of the mesh",
        )
    # One part in a billion of slack: a bound that came from a resolution gives it back.
    cells = longest_edge * ERROR_VOXELS / error_bound * (1.0 - 1e-9)
    if cells > MOST_VOXELS:
        least = longest_edge * ERROR_VOXELS / MOST_VOXELS
        raise OptionError(
            f"{error_bound!r} would need more than {MOST_VOXELS} voxels along the longest edge",
            where=where,
            remedy=f"choose {least:.6g} or more",
        )
    return max(1, math.ceil(cells))
