"""Which options each kind of job has, and what the service decides by itself.

What a server draws with is not among them: that is its owner's affair.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from service.jobs.job import JobKind
from service.schemas.options import OptionTable, Resolve
from simplifier import (
    EvaluateOptions,
    OptionField,
    OptionSet,
    SceneOptions,
    SimplifyOptions,
    TradeoffOptions,
    VisibilityOptions,
)

LEVELS = 3
"""Levels of detail of a result, where a request does not say."""

_RIVALS = (
    {"lods", "error_bounds"},
    {"moves", "time_limit"},
    {"resolution", "error_bound", "error_share", "error_bounds"},
)
"""Options of which one may be given."""

_KEPT = frozenset({"slicer", "device", "preview", "backend", "skip_buried"})
_GIB = 1 << 30


def with_changes(before: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a job and what is to be different: one that is given replaces its rivals.

    So it does the levels of detail that the service has chosen, where it allows none.
    """
    given = {name for name, value in changes.items() if value is not None}
    replaced = {name for rivals in _RIVALS if rivals & given for name in rivals}
    if _is_inside(changes) and before.get("lods") == LEVELS:
        replaced.add("lods")
    kept = {name: value for name, value in before.items() if name not in replaced}
    return {**kept, **changes}


def option_tables(job_seconds: float, job_memory: float) -> Mapping[JobKind, OptionTable]:
    """The tables by kind; a job may take ``job_seconds``, its refining no more than that, and
    ``job_memory`` bytes."""

    def table(options: type[OptionSet], resolve: Resolve) -> OptionTable:
        wanted = (one for one in options.fields() if one.name not in _KEPT)
        return OptionTable(tuple(_here(one, job_seconds, job_memory) for one in wanted), resolve)

    return {
        JobKind.OCCLUDER: table(SimplifyOptions, _simplify_options),
        JobKind.EVALUATION: table(EvaluateOptions, _resolver(EvaluateOptions)),
        JobKind.SCENE: table(SceneOptions, _resolver(SceneOptions)),
        JobKind.TRADEOFF: table(TradeoffOptions, _resolver(TradeoffOptions)),
        JobKind.VISIBILITY: table(VisibilityOptions, _resolver(VisibilityOptions)),
    }


def _here(field: OptionField, job_seconds: float, job_memory: float) -> OptionField:
    """An option with the limits and defaults of the service."""
    match field.name:
        case "memory_limit":
            most = min(field.high or math.inf, job_memory / _GIB)
            return replace(field, high=most, absent="the server's")
        case "time_limit":
            return replace(field, high=min(field.high or job_seconds, job_seconds))
        case "lods":
            return replace(field, absent=str(LEVELS))
        case _:
            return field


def _simplify_options(chosen: dict[str, Any]) -> dict[str, Any]:
    if not _is_inside(chosen) and chosen.get("error_bounds") is None and chosen.get("lods") is None:
        chosen = {**chosen, "lods": LEVELS}
    return _resolver(SimplifyOptions)(chosen)


def _is_inside(chosen: Mapping[str, Any]) -> bool:
    """Whether an occluder has to keep wholly inside, and so has no levels of detail."""
    shrink = chosen.get("shrink")
    shrunk = isinstance(shrink, (int, float)) and shrink > 0.0
    return chosen.get("conservative") is True or shrunk or chosen.get("overhang") == 0.0


def _resolver(options: type[OptionSet]) -> Resolve:
    """All options of a job from those that were given, as JSON has them."""

    def resolve(chosen: dict[str, Any]) -> dict[str, Any]:
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in vars(options.of(chosen)).items()
            if name not in _KEPT
        }

    return resolve
