"""Every option that users choose, as one table a command.

The command line, HTTP schemas and forms take names, kinds, limits and sentences from here, so that
they all say the same.  The option classes (``options.py``, ``lods/options.py``,
``hierarchy/options.py``, ``evaluation/accuracy.py``) keep the same limits; a test holds the two
together.  What depends on the mesh or on another option, only they can say.

Imports nothing that takes long: a process that only describes options stays small.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from simplifier.checks import (
    check_above_zero,
    check_flag,
    check_length,
    check_lengths,
    check_one_of,
    check_positive,
    check_several,
    check_whole,
    check_within,
)

Kind = Literal["whole", "number", "flag", "choice", "lengths", "wholes", "numbers"]


@dataclass(frozen=True)
class OptionField:
    """One option.

    ``name``      its Python keyword; the command line writes ``-`` for ``_``.
    ``kind``      a whole number, a number, yes or no, one of ``choices``, or a list of lengths, of
                  whole numbers or of numbers.
    ``default``   what counts where it is not given.
    ``help``      the sentence that users read.
    ``low``, ``high``  limits of a number, or of each of a list; None where there is none.
    ``low_excluded``  whether ``low`` itself is refused.
    ``nullable``  whether it may be None, which is then the default.
    ``absent``    what None stands for, in a word or two; empty where it stands for "not wanted".
    """

    name: str
    kind: Kind
    default: Any
    help: str
    low: float | None = None
    high: float | None = None
    low_excluded: bool = False
    choices: tuple[str, ...] = ()
    nullable: bool = False
    absent: str = ""

    @property
    def words(self) -> str:
        """The name as messages have it: "min precision"."""
        return self.name.replace("_", " ")

    def check(self, value: Any) -> None:
        """Raise :class:`~simplifier.errors.OptionError`, ``where`` being the words, where wrong.

        Kind and limits are looked at, nothing that another option or the mesh has a say in.
        """
        if value is None and self.nullable:
            return
        match self.kind:
            case "whole":
                self._check_whole(value)
            case "number":
                self._check_number(value)
            case "flag":
                check_flag(self.words, value)
            case "choice":
                check_one_of(self.words, value, self.choices)
            case "lengths":
                check_lengths(self.words, value)
            case "wholes":
                check_several(self.words, value)
                for one in value:
                    self._check_whole(one)
            case "numbers":
                check_several(self.words, value)
                for one in value:
                    self._check_number(one)

    def _check_whole(self, value: Any) -> None:
        check_whole(self.words, value, int(self.low or 0), int(self.high or 0))

    def _check_number(self, value: Any) -> None:
        if self.high is None:
            (check_positive if self.low_excluded else check_length)(self.words, value)
        elif self.low_excluded:
            check_above_zero(self.words, value, self.high)
        else:
            check_within(self.words, value, self.low or 0.0, self.high)


def _whole(
    name: str, default: int | None, low: int, high: int, help: str, absent: str = ""
) -> OptionField:
    return OptionField(
        name, "whole", default, help, low, high, nullable=default is None, absent=absent
    )


def _number(
    name: str,
    default: float | None,
    low: float,
    high: float | None,
    help: str,
    *,
    above: bool = False,
    absent: str = "",
) -> OptionField:
    """``above``: ``low`` itself is refused, and is 0."""
    return OptionField(
        name, "number", default, help, low, high, above, nullable=default is None, absent=absent
    )


def _flag(name: str, help: str) -> OptionField:
    return OptionField(name, "flag", False, help)


def _choice(name: str, choices: tuple[str, ...], default: str, help: str) -> OptionField:
    return OptionField(name, "choice", default, help, choices=choices)


def _wholes(name: str, default: tuple[int, ...], high: int, help: str) -> OptionField:
    return OptionField(name, "wholes", default, help, 1, high)


_MOST_TRIANGLES = 100_000
_MOST_VOXELS = 1024
_MOST_MOVES = 100_000_000
_LARGEST_SEED = 2**63 - 1
_AXES = ("x", "y", "z")

_TRANSPARENT = _choice(
    "transparent", ("leave-out", "keep"), "leave-out",
    "Triangles of the file that one can see through: leave-out, or keep.",
)  # fmt: skip

_MEMORY_LIMIT = _number(
    "memory_limit", None, 0.0, 1e6,
    "GiB that the run may need at most: beyond, it is refused before it begins.",
    above=True, absent="half of the machine's",
)  # fmt: skip

SIMPLIFY_FIELDS = (
    _whole("budget", 64, 1, _MOST_TRIANGLES, "Most triangles of the occluder."),
    _whole("resolution", None, 1, _MOST_VOXELS, "Voxels along the longest edge.", "64"),
    _number(
        "error_bound", None, 0.0, None,
        "In place of a resolution: largest deviation, in the mesh's units.", above=True,
    ),
    _whole(
        "lods", None, 1, 16, "Levels of detail, each of half the resolution and half the budget."
    ),
    OptionField(
        "error_bounds", "lengths", None, "Levels of detail by their error bounds in its place.",
        low=0.0, low_excluded=True, nullable=True,
    ),
    _number(
        "pixel_error", None, 0.01, 1000.0, "Pixels that a level's error may have.", absent="1"
    ),
    _whole("screen_height", None, 1, 100_000, "Of the screen, in pixels.", "1080"),
    _number("fov", None, 1.0, 179.0, "Vertical field of view, degrees.", absent="60"),
    _choice("up", _AXES, "y", "The mesh's up axis: x, y or z."),
    _flag("ground", "The mesh stands on the ground: close its open base."),
    _choice(
        "viewers", ("all", "above"), "all",
        "Where viewers can be: all, or above (looking level or down; on the ground).",
    ),
    _TRANSPARENT,
    _number(
        "smallest_hole", 0.0, 0.0, None,
        "Openings narrower than this count as closed, in the mesh's units.",
    ),
    _flag("conservative", "Keep wholly inside: never hide too much if closed."),
    _number(
        "shrink", 0.0, 0.0, None,
        "Keep this deep inside, in the mesh's units: what is hidden from a point is hidden from "
        "all points this near to it.",
    ),
    _choice(
        "trim", ("gain", "area"), "gain", "How the budget is met: gain, or area as published."
    ),
    _number(
        "alpha", 0.001, 0.0, 1.0, "Stop adding polygons that raise the measure by less than this."
    ),
    _choice("slicer", ("cpu", "gl"), "cpu", "cpu, or gl for the OpenGL stencil buffer."),
    _choice(
        "preset", ("draft", "balanced", "best"), "balanced",
        "How much time to spend: draft, balanced or best.",
    ),
    _number(
        "min_precision", 0.995, 0.0, 1.0, "Precision to aim for at least; more of it hides less."
    ),
    _whole(
        "moves", None, 0, _MOST_MOVES, "Refining moves; 0 leaves the cut as it is.", "by preset"
    ),
    _number(
        "time_limit", None, 0.0, 1e6,
        "Seconds to spend, in place of moves: less shortens the preset's work, more goes on "
        "refining. Reading the mesh and the report come on top. Results differ from run to run.",
        above=True, absent="by preset",
    ),
    _whole("seed", 0, 0, _LARGEST_SEED, "Seed of everything random."),
    _whole("views", 256, 1, 65_536, "Views that accuracy is measured from."),
    _whole("image", 256, 8, 4096, "Pixels a side of each view."),
    _whole("quads", 32_000, 1, 10_000_000, "Random quads in each view."),
    _flag("exact", "Count all quads in place of a sample."),
    _MEMORY_LIMIT,
)  # fmt: skip
"""Options of ``occluder simplify``, in the order of its help."""

_JUDGED_BY = frozenset({
    "resolution", "up", "ground", "viewers", "transparent", "smallest_hole", "seed", "views",
    "image", "quads", "exact", "memory_limit",
})  # fmt: skip

EVALUATE_FIELDS = tuple(one for one in SIMPLIFY_FIELDS if one.name in _JUDGED_BY)
"""Options of ``occluder evaluate``: those that say what is inside, and how accuracy is measured."""

SCENE_FIELDS = (
    _whole(
        "budget", 64, 1, _MOST_TRIANGLES,
        "Most triangles of an object's occluder; those above it have half.",
    ),
    _whole("resolution", 64, 1, _MOST_VOXELS, "Voxels along the longest edge of a node."),
    _whole("width", 8, 2, 64, "Most children of a node."),
    _whole("moves", 2400, 0, _MOST_MOVES, "Refining moves for a node."),
    _choice("up", _AXES, "y", "The scene's up axis: x, y or z."),
    _flag("ground", "Objects stand on the ground: close open bases."),
    _number(
        "smallest_hole", 0.0, 0.0, None,
        "Openings narrower than this count as closed, scene's units.",
    ),
    _flag("conservative", "Keep wholly inside: never hide too much if closed."),
    _number(
        "pixel_error", 0.5, 0.0, 1000.0,
        "Largest error of what is drawn, in pixels of the depth buffer.", above=True,
    ),
    _whole("rows", 180, 1, 16_384, "Height of the depth buffer, pixels."),
    _number("fov", 60.0, 1e-6, 179.0, "Vertical field of view, degrees."),
    _flag("preview", "Write all leaves' occluders to preview.glb."),
    _whole("seed", 0, 0, _LARGEST_SEED, "Seed of everything random."),
    _MEMORY_LIMIT,
)  # fmt: skip
"""Options of ``occluder scene``, in the order of its help."""

_SWEPT = frozenset({"up", "ground", "transparent", "seed", "memory_limit"})

TRADEOFF_FIELDS = (
    _wholes("resolutions", (32, 64, 128), _MOST_VOXELS, "Resolutions to try."),
    _wholes("directions", (16, 32, 128), 4096, "Section directions to try."),
    _wholes("budgets", (16, 64, 256), _MOST_TRIANGLES, "Budgets, each with a front of its own."),
    OptionField(
        "times", "numbers", (0.25, 0.5, 1.0, 2.0, 5.0), "Times to try, seconds.", 0.0, 1e6, True
    ),
    _number("precision", 0.99, 0.0, 1.0, "Least precision, 0 to 1, of a setting on the front."),
    _whole("repeats", 3, 1, 1000, "Runs a setting; their median time counts."),
    _flag("full", "Every combination, not one knob at a time."),
    *(one for one in SIMPLIFY_FIELDS if one.name in _SWEPT),
)
"""Options of ``occluder tradeoff``, in the order of its help."""
