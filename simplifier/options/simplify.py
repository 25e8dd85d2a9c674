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
DeviceChoice = Literal["auto", "cpu", "gpu"]
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

    budget: int = option(
        64, "Maximum number of triangles in the occluder.",
        low=1, high=MOST_TRIANGLES, group="Quality",
    )  # fmt: skip
    resolution: int | None = option(
        None, "Voxels along the mesh's longest edge. More voxels follow the mesh more closely and"
        " take longer.", low=1, high=MOST_VOXELS, absent="64", unit="voxels", group="Quality",
    )  # fmt: skip
    error_bound: float | None = option(
        None, "Maximum distance between the occluder and the mesh, in the mesh's units. Raises the"
        " resolution where it must.", above=0.0, unit="world units", group="Quality",
    )  # fmt: skip
    error_share: float | None = option(
        None, "The same distance as a share of the mesh's longest edge.",
        above=0.0, high=1.0, group="Quality",
    )  # fmt: skip
    lods: int | None = option(
        None, "Number of levels of detail. Each has half the resolution and half the triangles of"
        " the one before.", low=1, high=MOST_LEVELS, group="Levels of detail",
    )  # fmt: skip
    error_bounds: tuple[float, ...] | None = option(
        None, "Error bound of each level of detail, in the mesh's units, in place of their number.",
        above=0.0, kind="lengths", unit="world units", group="Levels of detail",
    )  # fmt: skip
    pixel_error: float | None = option(
        None, "Error that a level of detail may show on the screen, in pixels.",
        low=0.01, high=1000.0, absent="1", unit="pixels", group="Levels of detail",
    )  # fmt: skip
    screen_height: int | None = option(
        None, "Height of the screen, in pixels.",
        low=1, high=100_000, absent="1080", unit="pixels", group="Levels of detail",
    )  # fmt: skip
    fov: float | None = option(
        None, "Vertical field of view, in degrees.",
        low=1.0, high=179.0, absent="60", unit="degrees", group="Levels of detail",
    )  # fmt: skip
    up: Axis = option("y", "The mesh's up axis: x, y or z.", group="Input and scene")
    ground: bool = option(
        False, "The mesh stands on the ground. Closes its open base.", group="Input and scene"
    )
    viewers: Viewers = option(
        "all", "Where viewers can be: all (anywhere outside), above (on the ground, looking level"
        " or down), or inside (outside and in every room that one can walk in; rooms stay open).",
        group="Input and scene",
    )  # fmt: skip
    eye_height: float = option(
        EYE_HEIGHT, "Height of a viewer's eyes above the floor, in the mesh's units; counts with"
        f" viewers inside. {EYE_HEIGHT:g} suits metres.",
        above=0.0, unit="world units", group="Input and scene",
    )  # fmt: skip
    fill: Fill = option(
        "sight", "What counts as inside: sight (what hardly any viewer can see), or flood (what"
        " the surface encloses).", group="Input and scene",
    )  # fmt: skip
    transparent: Transparent = option(
        "leave-out", "Transparent surfaces must not occlude: leave-out ignores them, keep treats"
        " them as solid.", group="Input and scene",
    )  # fmt: skip
    smallest_hole: float = option(
        0.0, "Closes openings narrower than this, in the mesh's units.",
        low=0.0, unit="world units", group="Input and scene",
    )  # fmt: skip
    conservative: bool = option(
        False, "Keeps the occluder wholly inside, or on the mesh where next to nothing is inside."
        " A closed mesh is then never hidden too much.", group="Quality",
    )  # fmt: skip
    shrink: float = option(
        0.0, "Inset the occluder by this distance, in the mesh's units. What it hides from one"
        " viewpoint is then hidden from every viewpoint within that distance.",
        low=0.0, unit="world units", group="Quality",
    )  # fmt: skip
    trim: Trim = option(
        "gain", "How polygons are chosen when there are too many: by gain in occlusion, or by area"
        " as published.",
    )  # fmt: skip
    alpha: float = option(
        0.001, "Stop adding polygons when the next one raises the occlusion measure by less than"
        " this.", low=0.0, high=1.0,
    )  # fmt: skip
    slicer: Slicing = option(
        "cpu",
        "What cuts the sections: cpu, or gl for the OpenGL stencil buffer, which takes longer.",
    )
    device: DeviceChoice = option(
        "cpu", "What draws and measures: cpu, gpu (a graphics card, by OpenGL), or auto (the card,"
        " if there is one). The result is the same.",
    )  # fmt: skip
    preset: Preset = option(
        "balanced", "How much time to spend: draft, balanced or best.", group="Quality"
    )
    min_precision: float | None = option(
        None, "Target precision, 0 to 1. A higher target hides less.", low=0.0, high=1.0,
        absent=f"0.999; 0.995 with an overhang above {LITTLE_OVERHANG:g}", group="Quality",
    )  # fmt: skip
    overhang: float = option(
        0.005, "How much the occluder may cover beside the mesh, as a share of the mesh's"
        " silhouette. A lower share hides less; 0 keeps the occluder wholly inside.",
        low=0.0, high=1.0, group="Quality",
    )  # fmt: skip
    front: float = option(
        1.0, "How much of the visible mesh may lie well behind the occluder, as a share of its"
        " pixels. A lower share hides less; 1 sets no limit.", low=0.0, high=1.0, group="Quality",
    )  # fmt: skip
    moves: int | None = option(
        None, "Number of refining moves. 0 leaves the first cut as it is.",
        low=0, high=MOST_MOVES, absent="by preset",
    )  # fmt: skip
    time_limit: float | None = option(
        None, "Seconds to spend, in place of a number of moves. Reading the mesh and measuring the"
        " result come on top. Results differ from run to run.",
        above=0.0, high=LONGEST_SECONDS, absent="by preset", unit="seconds", group="Quality",
    )  # fmt: skip
    seed: int = option(
        0, "Seed of all random numbers. The same seed gives the same result.",
        low=0, high=LARGEST_SEED,
    )  # fmt: skip
    views: int = option(
        256, "Number of views that accuracy is measured from.",
        low=1, high=65_536, group="Measurement",
    )  # fmt: skip
    image: int = option(
        256, "Width and height of each view, in pixels.",
        low=8, high=4096, unit="pixels", group="Measurement",
    )  # fmt: skip
    quads: int = option(
        32_000, "Random quads that each view is measured with.",
        low=1, high=10_000_000, group="Measurement",
    )  # fmt: skip
    exact: bool = option(
        False, "Count every possible quad in place of a sample.", group="Measurement"
    )
    memory_limit: float | None = option(
        None, "Memory that the run may use, in GiB. A run that needs more is refused before it"
        " begins.", above=0.0, high=1e6, absent="half of the machine's", unit="GiB",
        of_result=False,
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
        "double", "double, or single for engines that cull back faces: triangles that can be seen"
        " from both sides are then written twice.", group="Output",
    )  # fmt: skip
    as_quads: bool = option(
        False, "Write two triangles as a quad where they form one: obj, off, ply.", group="Output"
    )
    with_original: Embedding | None = option(
        None, "Write the original mesh as well, to a glb. The occluder is a node NAME-occonly"
        " (godot), or the coarsest level of detail (lod).", group="Output",
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
    device: DeviceChoice = shared(SimplifyOptions, "device")
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
