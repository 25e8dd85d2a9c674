"""Options of ``simplify``, ``evaluate`` and ``scene``: any that go together, and any that do not.

Drawn from the tables of :mod:`simplifier.options`, so that a new option is fuzzed as soon as
it is there.  What takes long or gigabytes is kept small; everything else goes to its limits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from hypothesis import strategies as st

from simplifier import EvaluateOptions, OptionField, SceneOptions, SimplifyOptions

Chosen = dict[str, Any]

_MOST = {
    "resolution": 24, "moves": 60, "views": 12, "image": 24, "quads": 200, "lods": 4, "rows": 400,
    "budget": 200, "time_limit": 0.2,
}  # fmt: skip
"""The most that is drawn of what time or memory grows with."""

_LEAST_BOUND = 0.15
"""Of an error bound, in longest edges of the mesh: about as many voxels as the finest grid here."""

_NO_VALUES: tuple[Any, ...] = (
    None, "", "x", "1", -1, 0.5, 1.5, 2**70, -(10**400), 10**400, math.nan, math.inf, -math.inf,
    True, [], [1], {}, (), "ALL", "z ", b"y", 1j,
)  # fmt: skip


def _number(low: float, high: float, excluded: bool) -> st.SearchStrategy[float]:
    small = min(high, 1e-6) if excluded else low
    edges = st.sampled_from([small, high, 0.5 * (small + high)])
    return st.one_of(edges, st.floats(low, high, exclude_min=excluded))


def _lengths(longest: float) -> st.SearchStrategy[float]:
    """Those that a mesh of that longest edge can do something with, and some that it cannot."""
    shares = st.sampled_from([0.0, 0.0, 0.0, 1e-9, 0.01, 0.1, 0.1, 0.2, 0.5, 1.0, 1.0000001, 1e9])
    return shares.map(lambda share: share * longest).filter(math.isfinite)


def _bounds(longest: float) -> st.SearchStrategy[float]:
    """Error bounds: of coarse grids, and of grids too fine for any machine."""
    usual = st.floats(_LEAST_BOUND, 1.0)
    shares = st.one_of(usual, usual, usual, usual, st.sampled_from([1e-12, 1e-4, 1e3]))
    return shares.map(lambda share: share * longest).filter(lambda one: 0.0 < one < math.inf)


def _values(field: OptionField, longest: float, *, some: bool) -> st.SearchStrategy[Any]:
    """What the table allows for an option by itself, and None where that is allowed too, unless
    ``some`` value is to be there."""
    low = 0.0 if field.low is None else field.low
    high = _MOST.get(field.name, math.inf if field.high is None else field.high)
    match field.kind:
        case "whole":
            ends = st.sampled_from([int(low), int(high)])
            found: st.SearchStrategy[Any] = ends | st.integers(int(low), int(high))
        case "number" if field.name == "error_bound":
            found = _bounds(longest)
        case "number" if field.name == "error_share":
            found = _bounds(1.0).filter(lambda share: share <= 1.0)
        case "number" if field.name == "eye_height":  # lower eyes take seconds to find floors for
            found = st.sampled_from([1e-6, 0.1, 0.3, 1.0, 1e6]).map(lambda share: share * longest)
        case "number" if field.high is None:
            found = _lengths(longest)
        case "number":
            found = _number(low, high, field.low_excluded)
        case "flag":
            found = st.booleans()
        case "choice":  # OpenGL is not there on every machine
            found = st.sampled_from([one for one in field.choices if one not in ("gl", "gpu")])
        case "lengths":
            found = st.lists(_bounds(longest), min_size=1, max_size=4, unique=True)
        case kind:
            raise AssertionError(f"{field.name} is of a kind {kind!r} that is not drawn yet")
    return st.none() | found if field.nullable and not some else found


def _chosen(
    fields: Iterable[OptionField], longest: float, given: Iterable[str], never: Iterable[str] = ()
) -> st.SearchStrategy[Chosen]:
    """Each option left out or chosen; of what is ``given`` the default would take too long."""
    needed, left_out = set(given), set(never)
    drawn = {
        one.name: _values(one, longest, some=one.name in needed)
        for one in fields
        if one.name not in left_out
    }
    # In one order, whatever that of a set is: the same seed is to draw the same.
    costly = {name: drawn.pop(name) for name in list(drawn) if name in needed}
    return st.fixed_dictionaries(costly, optional=drawn)


_PRESETS = ("draft", "draft", "draft", "balanced", "balanced", "best")
_ACCURACY = ("views", "image", "quads")
_INSIDE = ("conservative", "shrink")
_SCREEN = ("pixel_error", "screen_height", "fov")


@st.composite
def simplify_options(draw: st.DrawFn, longest: float = 1.0) -> Chosen:
    """Options that ``SimplifyOptions.of`` takes, for a mesh of that longest edge.

    What depends on the mesh may still be refused: a hole that is longer, a bound too fine.
    """
    fineness = draw(st.sampled_from(["resolution", "error_bound", "error_share", "error_bounds"]))
    effort = draw(st.sampled_from(["moves", "moves", "time_limit"]))
    levels = fineness == "error_bounds" or draw(st.booleans())
    given = {fineness, effort, *_ACCURACY} | ({"lods"} if fineness != "error_bounds" else set())
    never = {"resolution", "error_bound", "error_share", "error_bounds", "moves", "time_limit"}
    never |= {"lods", "preset"}
    if not levels:
        given.discard("lods")
    never |= set(_INSIDE if levels else _SCREEN)
    chosen = draw(_chosen(SimplifyOptions.fields(), longest, given, never - given))
    if levels and chosen.get("overhang") == 0.0:  # keeps wholly inside as well
        del chosen["overhang"]
    return {**chosen, "preset": draw(st.sampled_from(_PRESETS))}


def evaluate_options(longest: float = 1.0) -> st.SearchStrategy[Chosen]:
    """Options that ``EvaluateOptions.of`` takes."""
    return _chosen(EvaluateOptions.fields(), longest, ("resolution", *_ACCURACY))


def scene_options(longest: float = 1.0) -> st.SearchStrategy[Chosen]:
    """Keyword arguments of ``simplify_scene``."""
    return _chosen(SceneOptions.fields(), longest, ("resolution", "moves", "budget"))


@st.composite
def wrong_options(draw: st.DrawFn) -> Chosen:
    """Valid options of ``simplify`` but for one, which is of another kind, out of range or unknown.

    A value may by chance be right: a test has to bear that nothing is refused.
    """
    chosen = draw(simplify_options())
    names = [one.name for one in SimplifyOptions.fields()]
    name = draw(st.sampled_from([*names, "", "budgets", "Budget"]))
    chosen[name] = draw(st.sampled_from(_NO_VALUES))
    return chosen
