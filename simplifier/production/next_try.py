"""The command to try next, where a result is not good: the one that was run, and a change.

The change goes for the worst fault.  What cannot be told from the options is left as it was.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from simplifier.accuracy.verdict import EngineVerdict, Figure
from simplifier.options.fields import OptionSet
from simplifier.options.simplify import MOST_TRIANGLES, EvaluateOptions, SimplifyOptions
from simplifier.wording import command_line

Names = tuple[str, str]
"""What the mesh and the occluder are called in a command."""

NAMES: Names = ("MESH", "OCCLUDER")
"""Where files have no names."""

_LARGEST_IMAGE = 4096
_FINER = 4  # times as many pixels across
_BOX = 12  # triangles
_OF_SCENE = ("up", "ground", "transparent", "smallest_hole")
"""Options that say what is there, of a mesh as of a scene."""

_DEFAULTS = {one.name: one.default for one in SimplifyOptions.fields()}


def next_simplify(
    options: SimplifyOptions, verdict: EngineVerdict, names: Names = NAMES, objects: int = 1
) -> str | None:
    """What to run after ``occluder simplify``; None where there is nothing to better, or no way.

    ``objects``  how many objects of a scene's file the mesh is made of.
    """
    if verdict.is_good:
        return None
    fault, (mesh, occluder) = verdict.faults[0], names
    if fault.figure == "recall" and fault.word == "unusable" and objects > _most_objects(options):
        place = Path(occluder).with_suffix("")
        same = {name: value for name, value in _given(options).items() if name in _OF_SCENE}
        return command_line(["occluder", "scene", Path(mesh), "-o", place, *_typed(same)])
    changes = _changes(options, fault.figure)
    if all(getattr(options, name) == value for name, value in changes.items()):
        return None
    words: list[str | Path] = ["occluder", "simplify", Path(mesh), "-o", Path(occluder)]
    return command_line([*words, *_typed({**_given(options), **changes})])


def next_evaluate(
    options: EvaluateOptions, verdict: EngineVerdict, names: Names = NAMES
) -> str | None:
    """What to run after ``occluder evaluate``: make one, or look closer at a mesh that is thin."""
    if verdict.is_good:
        return None
    mesh, occluder = names
    given = _given(options)
    if verdict.faults[0].figure != "coverage":
        # Not in the place of what somebody made by hand.
        place = Path(mesh)
        own = Path(occluder) if names == NAMES else place.with_name(f"{place.stem}_occluder.glb")
        return command_line(["occluder", "simplify", place, "-o", own, *_typed(given)])
    if options.image >= _LARGEST_IMAGE:
        return None
    closer = {**given, "image": _finer(options.image)}
    words: list[str | Path] = ["occluder", "evaluate", Path(mesh), Path(occluder)]
    return command_line([*words, *_typed(closer)])


def look_command(options: SimplifyOptions, names: Names) -> str:
    """What draws where the occluder of a file hides, judged as it was made."""
    mesh, occluder = names
    folder = Path(f"{Path(occluder).with_suffix('')}_pictures")
    of_judging = {one.name for one in EvaluateOptions.fields()}
    given = {name: value for name, value in _given(options).items() if name in of_judging}
    words: list[str | Path] = [
        "occluder",
        "evaluate",
        Path(mesh),
        Path(occluder),
        "--pictures",
        folder,
    ]
    return command_line([*words, *_typed(given)])


def _changes(options: SimplifyOptions, figure: Figure) -> Mapping[str, Any]:
    if figure == "coverage":
        return {"image": _finer(options.image)}
    if figure == "recall" and options.wholly_inside:
        freed = {"conservative": False, "shrink": 0.0}
        return freed if options.overhang > 0.0 else {**freed, "overhang": _DEFAULTS["overhang"]}
    if figure != "recall" and options.overhang > _DEFAULTS["overhang"]:
        return {"overhang": _DEFAULTS["overhang"], "min_precision": None}
    done_all = options.preset == "best" and options.moves is None and options.time_limit is None
    if figure != "recall" and done_all and options.levels is None:
        return {"conservative": True}
    budget = min(2 * options.budget, MOST_TRIANGLES)
    return {"preset": "best", "moves": None, "time_limit": None, "budget": budget}


def _most_objects(options: SimplifyOptions) -> int:
    """Where there are more, twice the budget has no box for each of them; one is no scene."""
    return max(1, 2 * options.budget // _BOX)


def _finer(image: int) -> int:
    return min(_FINER * image, _LARGEST_IMAGE)


def _given(options: OptionSet) -> dict[str, Any]:
    """Those that are not as by default and have a part in the result."""
    return {
        one.name: getattr(options, one.name)
        for one in type(options).fields()
        if one.of_result and getattr(options, one.name) != one.default
    }


def _typed(values: Mapping[str, Any]) -> Iterator[str]:
    """As they are typed on the command line; what is as by default need not be."""
    for name, value in values.items():
        if value is None or value is False or value == _DEFAULTS[name]:
            continue
        yield f"--{name.replace('_', '-')}"
        if value is not True:
            yield ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
