"""What ``occluder simplify`` and ``occluder evaluate`` can be told."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

from simplifier.checks import check_flag, check_one_of
from simplifier.errors import OptionError
from simplifier.options.fields import OptionSet, option, passed_on, shared

MOST_VOXELS = 1024
"""The finest grid, in voxels along the longest edge."""

MOST_MOVES = 100_000_000
"""The longest search."""

MOST_TRIANGLES = 100_000
"""The largest budget."""

MOST_LEVELS = 16
"""The most levels of detail of one object."""

LARGEST_SEED = 2**63 - 1

LITTLE_OVERHANG = 0.01
"""A share of the silhouette, up to which precision is to be high and the room narrow."""

EYE_HEIGHT = 1.7
"""Of a walker's eyes over the ground, where the unit is a metre."""

LONGEST_SECONDS = 1e6
"""The longest time limit, seconds: eleven days."""

Slicing = Literal["cpu", "gl"]
Trim = Literal["gain", "area"]
Axis = Literal["x", "y", "z"]
Viewers = Literal["all", "above", "inside"]
Fill = Literal["sight", "flood"]
Transparent = Literal["leave-out", "keep"]
Preset = Literal["draft", "balanced", "best"]
Sides = Literal["double", "single"]

Embedding = Literal["godot", "lod"]
"""How an occluder is written with its original.  ``godot``: a node of the scene whose name ends in
"-occonly", of which Godot 4 makes an occluder.  ``lod``: the coarsest level of detail of the
scene's root, by MSFT_lod."""


@dataclass(frozen=True)
class SimplifyOptions(OptionSet):
    """All that ``occluder simplify`` can be told.

    ``transparent`` is for who reads the mesh: ``load(path, transparent=options.transparent)``.

    Raises :class:`OptionError` for a value of another kind or out of range, and for two that cannot
    go together.  Only what depends on the mesh is left to be found later: a hole longer than it,
    and an error bound that would take too fine a grid.
    """

    budget: int = option(64, "Most triangles of the occluder.", low=1, high=MOST_TRIANGLES)
    resolution: int | None = option(
        None, "Voxels along the longest edge.", low=1, high=MOST_VOXELS, absent="64", unit="voxels"
    )
    error_bound: float | None = option(
        None, "Largest deviation, in the mesh's units; raises the resolution where it must.",
        above=0.0, unit="world units",
    )  # fmt: skip
    error_share: float | None = option(
        None, "The same as a share of the mesh's longest edge.", above=0.0, high=1.0
    )
    lods: int | None = option(
        None, "Levels of detail, each of half the resolution and half the budget.",
        low=1, high=MOST_LEVELS,
    )  # fmt: skip
    error_bounds: tuple[float, ...] | None = option(
        None, "Levels of detail by their error bounds in its place.",
        above=0.0, kind="lengths", unit="world units",
    )  # fmt: skip
    pixel_error: float | None = option(
        None, "Pixels that a level's error may have.",
        low=0.01, high=1000.0, absent="1", unit="pixels",
    )  # fmt: skip
    screen_height: int | None = option(
        None, "Of the screen, in pixels.", low=1, high=100_000, absent="1080", unit="pixels"
    )
    fov: float | None = option(
        None, "Vertical field of view, degrees.", low=1.0, high=179.0, absent="60", unit="degrees"
    )
    up: Axis = option("y", "The mesh's up axis: x, y or z.")
    ground: bool = option(False, "The mesh stands on the ground: close its open base.")
    viewers: Viewers = option(
        "all", "Where viewers can be: all (outside), above (looking level or down; on the ground),"
        " or inside (outside, and wherever one can walk indoors, so that rooms stay open).",
    )  # fmt: skip
    eye_height: float = option(
        EYE_HEIGHT, "Of the eyes of viewers inside over the floor, in the mesh's units; "
        f"{EYE_HEIGHT:g} where they are metres.", above=0.0, unit="world units",
    )  # fmt: skip
    fill: Fill = option(
        "sight", "What counts as inside: sight (what hardly any viewer can see), or flood (what"
        " the surface closes off).",
    )  # fmt: skip
    transparent: Transparent = option(
        "leave-out", "Triangles of the file that one can see through: leave-out, or keep."
    )
    smallest_hole: float = option(
        0.0, "Openings narrower than this count as closed, in the mesh's units.",
        low=0.0, unit="world units",
    )  # fmt: skip
    conservative: bool = option(False, "Keep wholly inside: never hide too much if closed.")
    shrink: float = option(
        0.0, "Keep this deep inside, in the mesh's units: what is hidden from a point is hidden "
        "from all points this near to it.", low=0.0, unit="world units",
    )  # fmt: skip
    trim: Trim = option("gain", "How the budget is met: gain, or area as published.")
    alpha: float = option(
        0.001, "Stop adding polygons that raise the measure by less than this.", low=0.0, high=1.0
    )
    slicer: Slicing = option("cpu", "cpu, or gl for the OpenGL stencil buffer.")
    preset: Preset = option("balanced", "How much time to spend: draft, balanced or best.")
    min_precision: float | None = option(
        None, "Precision to aim for at least; more of it hides less.",
        low=0.0, high=1.0, absent=f"0.999; 0.995 with an overhang above {LITTLE_OVERHANG:g}",
    )  # fmt: skip
    overhang: float = option(
        0.005, "Most that the occluder may cover beside the mesh, as a share of its silhouette; "
        "less of it hides less, 0 keeps wholly inside.", low=0.0, high=1.0,
    )  # fmt: skip
    front: float = option(
        1.0, "Most of the mesh's pixels before which the occluder may stand off, as a share to aim"
        " for; less of it hides less, 1 is no limit.", low=0.0, high=1.0,
    )  # fmt: skip
    moves: int | None = option(
        None, "Refining moves; 0 leaves the cut as it is.",
        low=0, high=MOST_MOVES, absent="by preset",
    )  # fmt: skip
    time_limit: float | None = option(
        None, "Seconds to spend, in place of moves: less shortens the preset's work, more goes on "
        "refining. Reading the mesh and the report come on top. Results differ from run to run.",
        above=0.0, high=LONGEST_SECONDS, absent="by preset", unit="seconds",
    )  # fmt: skip
    seed: int = option(0, "Seed of everything random.", low=0, high=LARGEST_SEED)
    views: int = option(256, "Views that accuracy is measured from.", low=1, high=65_536)
    image: int = option(256, "Pixels a side of each view.", low=8, high=4096, unit="pixels")
    quads: int = option(32_000, "Random quads in each view.", low=1, high=10_000_000)
    exact: bool = option(False, "Count all quads in place of a sample.")
    memory_limit: float | None = option(
        None, "GiB that the run may need at most: beyond, it is refused before it begins.",
        above=0.0, high=1e6, absent="half of the machine's", unit="GiB", of_result=False,
    )  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.levels is not None:
            finest_bound(self)
            check_outside(self.wholly_inside)
            _refuse_both("error bound", self.error_bound, "a resolution", self.resolution)
            _refuse_both("error share", self.error_share, "a resolution", self.resolution)
        _refuse_both("error share", self.error_share, "an error bound", self.error_bound)
        _refuse_both("time limit", self.time_limit, "moves", self.moves)

    @property
    def least_precision(self) -> float:
        """The precision to aim for: more where little may stick out."""
        if self.min_precision is not None:
            return self.min_precision
        return 0.999 if self.overhang <= LITTLE_OVERHANG else 0.995

    @property
    def levels(self) -> LodOptions | None:
        """Which levels of detail; None for a single occluder."""
        if self.lods is None and self.error_bounds is None:
            for name in ("pixel_error", "screen_height", "fov"):
                if getattr(self, name) is not None:
                    raise OptionError(
                        "only levels of detail have one",
                        where=name.replace("_", " "),
                        remedy="give lods or error bounds as well",
                    )
            return None
        return passed_on(LodOptions, self)

    @property
    def wholly_inside(self) -> bool:
        """Whether the occluder keeps to voxels that are wholly inside."""
        return self.conservative or self.shrink > 0.0 or self.overhang == 0.0


@dataclass(frozen=True)
class WriteOptions(OptionSet):
    """How ``occluder simplify`` and builds write an occluder, whatever the format."""

    sides: Sides = option(
        "double", "single: for engines that cull back faces, both windings are written."
    )
    as_quads: bool = option(False, "Write quads where triangles pair up: obj, off, ply.")
    with_original: Embedding | None = option(
        None, "Write the original too, to a glb, with the occluder as a node NAME-occonly"
        " (godot) or as its coarsest level of detail (lod).",
    )  # fmt: skip


@dataclass(frozen=True)
class LodOptions(OptionSet):
    """Which levels of detail of one object, and how they are looked at.

    Raises :class:`OptionError` for both or neither of ``lods`` and ``error_bounds``.
    """

    lods: int | None = shared(SimplifyOptions, "lods")
    """How many, from fine to coarse: each further one has half the resolution and half the
    budget."""

    error_bounds: tuple[float, ...] | None = shared(SimplifyOptions, "error_bounds")
    """In place of a number: the error bound of each, world units, 1 to 16 different lengths in any
    order, kept in rising order; budgets fall in proportion to the resolutions."""

    pixel_error: float = shared(SimplifyOptions, "pixel_error", 1.0)
    """Pixels that a level's error may have on the screen.  Raising it lets coarser levels come
    nearer."""

    screen_height: int = shared(SimplifyOptions, "screen_height", 1080)
    """Pixels from top to bottom of the screen."""

    fov: float = shared(SimplifyOptions, "fov", 60.0)
    """Vertical field of view, degrees."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.lods is None) == (self.error_bounds is None):
            raise OptionError(
                "give either a number of levels or their error bounds",
                where="lods",
                remedy="choose one of the two",
            )
        if self.error_bounds is not None:
            object.__setattr__(self, "error_bounds", _rising(self.error_bounds))


@dataclass(frozen=True)
class EvaluateOptions(OptionSet):
    """All that ``occluder evaluate`` can be told: what counts as inside, and how accuracy is
    measured.

    Raises :class:`OptionError` for a value of another kind or out of range.
    """

    resolution: int | None = shared(SimplifyOptions, "resolution")
    up: Axis = shared(SimplifyOptions, "up")
    ground: bool = shared(SimplifyOptions, "ground")
    viewers: Viewers = shared(SimplifyOptions, "viewers")
    eye_height: float = shared(SimplifyOptions, "eye_height")
    fill: Fill = shared(SimplifyOptions, "fill")
    transparent: Transparent = shared(SimplifyOptions, "transparent")
    smallest_hole: float = shared(SimplifyOptions, "smallest_hole")
    seed: int = shared(SimplifyOptions, "seed")
    views: int = shared(SimplifyOptions, "views")
    image: int = shared(SimplifyOptions, "image")
    quads: int = shared(SimplifyOptions, "quads")
    exact: bool = shared(SimplifyOptions, "exact")
    memory_limit: float | None = shared(SimplifyOptions, "memory_limit")


def finest_bound(chosen: SimplifyOptions, longest_edge: float = 1.0) -> float | None:
    """The error bound of the occluder, or of the finest level, that was asked for; None for none.

    ``longest_edge`` of the mesh, which a share is of.  Raises :class:`OptionError` when the levels
    have error bounds and a resolution or an error bound is given as well.
    """
    if chosen.levels is None or chosen.levels.error_bounds is None:
        if chosen.error_share is not None:
            return chosen.error_share * longest_edge
        return chosen.error_bound
    _refuse_both("error bounds", chosen.error_bounds, "a resolution", chosen.resolution)
    _refuse_both("error bounds", chosen.error_bounds, "an error bound", chosen.error_bound)
    _refuse_both("error bounds", chosen.error_bounds, "an error share", chosen.error_share)
    return chosen.levels.error_bounds[0]


def check_outside(wholly_inside: bool) -> None:
    """Refuse levels of occluders that keep wholly inside: none has an error to be chosen by."""
    if wholly_inside:
        raise OptionError(
            "levels of detail cannot be kept wholly inside: their error bound is 0 at any distance",
            where="lods",
            remedy="leave out conservative and shrink, or make single occluders",
        )


def _rising(bounds: tuple[float, ...]) -> tuple[float, ...]:
    """The lengths in rising order, if they are different and not too many."""
    if not 1 <= len(bounds) <= MOST_LEVELS:
        raise OptionError(
            f"{len(bounds)} lengths are given",
            where="error bounds",
            remedy=f"give 1 to {MOST_LEVELS}",
        )
    rising = tuple(sorted(map(float, bounds)))
    for finer, coarser in pairwise(rising):
        if finer == coarser:
            raise OptionError(
                f"{coarser!r} is given twice", where="error bounds", remedy="give each length once"
            )
    return rising


def _refuse_both(name: str, value: object, other: str, rival: object) -> None:
    """Two answers to one question."""
    if value is not None and rival is not None:
        raise OptionError(
            f"cannot be given together with {other}", where=name, remedy="choose one of the two"
        )


@dataclass(frozen=True)
class Style:
    """``sides``  "double": for renderers that draw both sides of a triangle.  "single": for those
    that cull back faces, so that triangles which can be seen from both sides are there twice.
    ``quads``  write two triangles as a quad where they pair up, in formats that have quads.

    Raises :class:`~simplifier.errors.OptionError`.
    """

    sides: Sides = "double"
    quads: bool = False

    def __post_init__(self) -> None:
        check_one_of("sides", self.sides, get_args(Sides))
        check_flag("quads", self.quads)


PLAIN = Style()
