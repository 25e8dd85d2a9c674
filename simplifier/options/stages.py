"""What the stages are told, a frozen dataclass each, made of what a command was told.

Every field has its unit, its range and what raising it does.  Defaults are safe.  A value out of
range raises :class:`~simplifier.errors.OptionError` when the options are made, so no stage checks
again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from simplifier.checks import is_finite, value_text
from simplifier.errors import OptionError
from simplifier.options.fields import OptionSet, option, passed_on, shared
from simplifier.options.simplify import (
    LITTLE_OVERHANG,
    MOST_VOXELS,
    Axis,
    DeviceChoice,
    EvaluateOptions,
    Fill,
    Preset,
    SimplifyOptions,
    Slicing,
    Trim,
    Viewers,
    finest_bound,
)
from simplifier.options.tradeoff import MOST_DIRECTIONS

TOLERANCE_VOXELS = 1.0
"""How far Ramer-Douglas-Peucker may move an outline, in voxels (section 4.3: the voxel size)."""

TOUCHED_VOXELS = math.sqrt(3.0)
"""The error bound in voxels of what keeps to the solid: the diagonal of a touched one."""

ERROR_VOXELS = 2.0 * TOUCHED_VOXELS
"""The error bound in voxels.  A refined triangle keeps to voxels that touch the solid, at most a
voxel's diagonal from one of it, and a touched voxel holds a point of the surface, at most another
diagonal away.  An outline that is not refined reaches less far: half a pixel's diagonal and the
tolerance past the solid."""

_FINEST = 256  # voxels along the longest edge: pictures of 512 pixels tell little more
_FINEST_INSIDE = 512  # the shell of those that the surface touches is given up there
_MOST = 4  # voxels a cell along each axis
_MOST_INSIDE = 8


def fineness(resolution: int, inside: bool = False) -> int:
    """Voxels a cell along each axis, of the room for a solid of that resolution.

    ``inside``  whether triangles keep to voxels wholly inside.
    """
    finest, most = (_FINEST_INSIDE, _MOST_INSIDE) if inside else (_FINEST, _MOST)
    return min(max(finest // resolution, 1), most)


@dataclass(frozen=True)
class SolidOptions(OptionSet):
    """What counts as inside."""

    resolution: int = shared(SimplifyOptions, "resolution", 64)
    """Voxels along the longest edge, 1 to 1024.  Raising it tightens the error bound; time and
    memory grow with its square to cube."""

    up: Axis = shared(SimplifyOptions, "up")
    """The asset's up axis; with ``ground`` its low end is the ground."""

    ground: bool = shared(SimplifyOptions, "ground")
    """The asset stands on the ground: nothing enters from below, so an open base is closed."""

    viewers: Viewers = shared(SimplifyOptions, "viewers")
    """Where viewers can be: everywhere outside; ``above``, looking level or downwards; or
    ``inside``, everywhere outside and wherever one can walk indoors."""

    eye_height: float = shared(SimplifyOptions, "eye_height")
    """World units, above 0: of the eyes of viewers inside over the floor."""

    fill: Fill = shared(SimplifyOptions, "fill")
    """``sight`` counts as inside what viewers see from next to no direction, beside what is closed
    off; ``flood`` that alone.  Where all is to be wholly inside, closed meshes are always filled by
    ``flood``, and with a ``shrink`` all are."""

    tolerance: float = option(0.1, low=0.0, high=1.0)
    """Share of all directions, 0 to 1, from which viewers may see what counts as inside by sight.
    Raising it fills deeper niches, and rooms behind larger windows."""

    smallest_hole: float = shared(SimplifyOptions, "smallest_hole")
    """World units, 0 or more: openings narrower than this count as closed; 0 closes none.  Raising
    it closes more, and shallow niches with it."""

    conservative: bool = shared(SimplifyOptions, "conservative")
    """Only voxels wholly inside count and the occluder keeps to them, so that a closed mesh is
    never covered past its edge.  Thin parts are lost; where that leaves next to nothing, triangles
    of the mesh itself stand in."""

    shrink: float = shared(SimplifyOptions, "shrink")
    """World units, 0 or more: the occluder keeps at least this far inside the solid, so that what
    it hides from a point it hides from all points within this length of it.  Above 0 it implies
    ``conservative``.  Raising it loses recall, and parts thinner than twice of it."""

    glue: bool = option(False)
    """One dilation step (section 5): voxels next to a touched one count as touched, so neighbours
    grow together, and the occluder keeps to the solid in place of going a voxel past it: the error
    bound stays.  Nothing grows past the bounding box.  Without effect where all is wholly inside.
    """

    @property
    def wholly_inside(self) -> bool:
        """Whether the occluder keeps to voxels that are wholly inside."""
        return self.conservative or self.shrink > 0.0

    @property
    def by_sight(self) -> bool:
        """Whether what is hardly seen counts as inside, of open meshes at least."""
        return self.fill == "sight" and self.shrink == 0.0


@dataclass(frozen=True)
class SectionOptions(OptionSet):
    """Where the solid is cut."""

    directions: int = option(128, low=1, high=MOST_DIRECTIONS)
    """Direction bins over a hemisphere, 1 to 4096, beside the three axes.  More bins find better
    planes; time grows in proportion."""

    direction_samples: int = option(1, low=1, high=64)
    """Directions tried in each bin, 1 to 64."""

    depths: int = option(4, low=1, high=1024)
    """Depth bins a direction, 1 to 1024."""

    depth_step: float = option(1.0, low=0.1, high=64.0, unit="voxels")
    """Distance of the planes tried in a depth bin, voxels, 0.1 to 64; less finds larger slices."""

    depth_samples: int = option(32, low=1, high=1024)
    """Most planes tried in a depth bin, 1 to 1024.  Up to 128 voxels the step alone counts; past
    that this keeps the time from growing with the cube of the resolution."""

    slicer: Slicing = shared(SimplifyOptions, "slicer")
    """``cpu`` samples the grid; ``gl`` draws the voxel mesh into an OpenGL stencil buffer."""


@dataclass(frozen=True)
class SelectionOptions(OptionSet):
    """Which polygons make the occluder."""

    budget: int = shared(SimplifyOptions, "budget")
    """Most triangles of the occluder, 1 to 100,000."""

    alpha: float = shared(SimplifyOptions, "alpha")
    """The cut is complete when another polygon would raise the occlusion measure by less than this
    share, 0 to 1."""

    trim: Trim = shared(SimplifyOptions, "trim")
    """How the budget is met: ``gain`` chooses polygons and levels by measure a triangle and
    improves them by exchange; ``area`` is the paper's trim by surface area."""

    views: int = option(48, low=1, high=MOST_DIRECTIONS, words="search views")
    """Directions that the occlusion measure is averaged over while searching, 1 to 4096."""

    exchanges: int = option(8, low=0, high=10_000)
    """How often two members of the cut are taken out and their triangles spent anew, 0 to 10,000;
    more gain little."""


@dataclass(frozen=True)
class RefineOptions(OptionSet):
    """How the chosen triangles are improved."""

    moves: int = shared(SimplifyOptions, "moves", 22_800)
    """Moves tried by each search, 0 to 100,000,000; 0 leaves the cut as it is.  More find better
    occluders; time grows in proportion."""

    searches: int = option(2, low=1, high=64)
    """Searches side by side, 1 to 64, that share the processors and take from each other what they
    gain by."""

    overcover: float = option(0.5, low=0.0, high=100.0)
    """What a measure that is hidden wrongly costs beside one hidden rightly, 0 to 100.  Raising it
    lifts precision and lowers recall."""

    precision: float = shared(SimplifyOptions, "min_precision", 0.999, words="min precision")
    """Precision that the search aims for at least, 0 to 1: where its own views show less, it raises
    the cost of what is hidden wrongly."""

    overhang: float = shared(SimplifyOptions, "overhang")
    """Overhang that the search aims for at most, 0 to 1, a share of the silhouette in the mean over
    all views: while there is more it fines what lies past the outline.  Among its results those
    are preferred that have no more than twice as much in any view."""

    front: float = shared(SimplifyOptions, "front")
    """Front that the search aims for at most, 0 to 1, a share of the original's pixels in the mean
    over all views; 1 leaves it as it comes."""

    views: int = option(144, low=1, high=MOST_DIRECTIONS, words="refine views")
    """Directions that the search looks from, 1 to 4096."""

    outlines: int = option(32, low=1, high=MOST_DIRECTIONS, words="refine outlines")
    """Directions that overhang and front are judged from, 1 to 4096, in finer pictures that the
    search does not see."""

    rounds: int = option(10, low=1, high=20, words="refine rounds")
    """How often at least searches take from each other and prices follow, 1 to 20.  A long search
    does so more often; where moves are few, fewer rounds leave more of them to each."""

    decimated: bool = option(True)
    """Begin a search from decimated surfaces too, and keep one as it is where that hides most."""


_FEW = 64  # triangles that a preset's moves are enough for
_MOST_MOVES = 8.0  # times as many for any number


@dataclass(frozen=True)
class Effort:
    """What a preset spends: sections and exchanges of the cut; what refines it, and its starts."""

    sections: SectionOptions
    exchanges: int
    moves: int  # for few triangles
    views: int
    outlines: int
    rounds: int
    decimated: bool


PRESETS: dict[Preset, Effort] = {
    "draft": Effort(
        SectionOptions(directions=16, depths=3), exchanges=0,
        moves=4_830, views=64, outlines=20, rounds=7, decimated=False,
    ),
    "balanced": Effort(
        SectionOptions(directions=32, depths=4), exchanges=0,
        moves=22_800, views=144, outlines=32, rounds=10, decimated=True,
    ),
    "best": Effort(
        SectionOptions(directions=128, depths=4), exchanges=8,
        moves=140_000, views=144, outlines=32, rounds=10, decimated=True,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Options(OptionSet):
    """All of a simplification."""

    solid: SolidOptions = field(default_factory=SolidOptions)
    sections: SectionOptions = field(default_factory=SectionOptions)
    selection: SelectionOptions = field(default_factory=SelectionOptions)
    refine: RefineOptions = field(default_factory=RefineOptions)
    seed: int = shared(SimplifyOptions, "seed")
    """Seed of every random choice, 0 to 2**63 - 1."""

    error_bound: float | None = None
    """World units that the occluder keeps to, above 0; None for what the resolution gives."""

    device: DeviceChoice = shared(SimplifyOptions, "device")
    """What draws the original and judges candidates."""

    time_limit: float | None = shared(SimplifyOptions, "time_limit")
    """Seconds from mesh to occluder, above 0: less shortens the preset's work, more goes on
    refining, whatever the moves.  None takes as long as the preset's work does."""

    @property
    def fine_room(self) -> bool:
        """Whether what may leave the solid is moved in voxels finer than the solid's own."""
        return self.refine.overhang < 1.0 or self.error_bound is not None

    @property
    def marks_finely(self) -> bool:
        """Whether triangles are marked in the voxels of the room, and the solid is made of those,
        where they are not too many to be held beside it."""
        stays = self.solid.wholly_inside or self.solid.glue or self.refine.moves == 0
        return self.fine_room and not stays

    @property
    def bound_from_fine_interior(self) -> bool:
        """Whether the error bound counts from what is inside in voxels of the room."""
        return self.error_bound is not None or LITTLE_OVERHANG < self.refine.overhang < 1.0


def stage_options(chosen: SimplifyOptions | EvaluateOptions, longest_edge: float) -> Options:
    """The options of every stage, for the occluder or the finest level of a mesh.

    ``longest_edge`` of the mesh's bounding box, world units, tells which resolution an error bound
    needs at least.  The preset says how much time to spend, and ``moves`` replaces its
    number of refining moves; with a time limit refining lasts until then in place of moves.
    Viewers above imply ``ground``, a ``shrink`` above 0 implies ``conservative``.

    Raises :class:`~simplifier.errors.OptionError` where an error bound would take too fine a grid,
    and where ``smallest_hole`` is longer than the mesh.
    """
    if isinstance(chosen, EvaluateOptions):
        chosen = SimplifyOptions(**vars(chosen))  # whose options it shares
    bound = finest_bound(chosen, longest_edge)
    resolution = chosen.resolution if bound is None else _kept_by(bound, chosen, longest_edge)
    if chosen.smallest_hole > longest_edge:
        raise OptionError(
            f"{chosen.smallest_hole!r} is longer than the mesh",
            where="smallest hole",
            remedy=f"choose 0 to {longest_edge:.6g}",
        )
    effort = PRESETS[chosen.preset]
    decided = {} if resolution is None else {"resolution": resolution}
    return passed_on(
        Options,
        chosen,
        error_bound=None if chosen.levels is not None else bound,
        solid=passed_on(
            SolidOptions,
            chosen,
            ground=chosen.ground or chosen.viewers == "above",
            conservative=chosen.wholly_inside,
            **decided,
        ),
        sections=replace(effort.sections, slicer=chosen.slicer),
        selection=passed_on(SelectionOptions, chosen, exchanges=effort.exchanges),
        refine=passed_on(
            RefineOptions,
            chosen,
            moves=_moves(effort, chosen.budget) if chosen.moves is None else chosen.moves,
            precision=chosen.least_precision,
            # What keeps wholly inside sticks out nowhere, so there is nothing to be fined.
            overhang=1.0 if chosen.wholly_inside else chosen.overhang,
            views=effort.views,
            outlines=effort.outlines,
            rounds=effort.rounds,
            decimated=effort.decimated,
        ),
    )


def _kept_by(bound: float, chosen: SimplifyOptions, longest_edge: float) -> int:
    """The resolution that was chosen, or the default, where that keeps the bound; else the least.

    Triangles that are moved keep to what the surface touches in a room that is finer than the grid
    of the sections.  A level of detail has the grid that its error allows.
    """
    if chosen.levels is not None:
        return resolution_for(bound, longest_edge)
    where = "error bound" if chosen.error_share is None else "error share"
    usual = chosen.resolution or SolidOptions().resolution
    if chosen.moves == 0 or chosen.wholly_inside:
        least, kept = resolution_for(bound, longest_edge, where), usual
    else:
        least = resolution_for(bound, longest_edge, where, TOUCHED_VOXELS)
        kept = usual * fineness(usual)
    if kept >= least:
        return usual
    if chosen.resolution is not None:
        raise OptionError(
            f"{chosen.resolution} cannot keep the {where}",
            where="resolution",
            remedy=f"choose {least} or more, or leave it out",
        )
    return least


def make_options(longest_edge: float, **changes: Any) -> Options:
    """As :func:`stage_options`, of the options of ``occluder simplify`` with some changed."""
    return stage_options(SimplifyOptions(**changes), longest_edge)


def _moves(effort: Effort, budget: int) -> int:
    """More for many triangles, though not in proportion: each needs some."""
    more = math.pow(max(budget / _FEW, 1.0), 0.75)
    return round(effort.moves * min(more, _MOST_MOVES))


def resolution_for(
    error_bound: float,
    longest_edge: float,
    where: str = "error bound",
    voxels: float = ERROR_VOXELS,
) -> int:
    """The least resolution that keeps the bound, of so many ``voxels``; ``where`` names the option.

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
    cells = longest_edge * voxels / error_bound * (1.0 - 1e-9)
    if cells > MOST_VOXELS:
        least = longest_edge * voxels / MOST_VOXELS
        raise OptionError(
            f"{error_bound!r} would need more than {MOST_VOXELS} voxels along the longest edge",
            where=where,
            remedy=f"choose {least:.6g} or more",
        )
    return max(1, math.ceil(cells))
