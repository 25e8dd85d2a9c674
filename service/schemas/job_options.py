"""Which options each kind of job has, and what the service decides by itself.

The slicer is not among them: what a server draws with is its owner's affair.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from service.jobs.job import JobKind
from service.schemas.options import OptionTable
from simplifier import (
    EVALUATE_FIELDS,
    SCENE_FIELDS,
    SIMPLIFY_FIELDS,
    TRADEOFF_FIELDS,
    EvaluateOptions,
    OptionField,
    SimplifyOptions,
    TradeoffOptions,
)

LEVELS = 3
"""Levels of detail of a result, where a request does not say."""

_KEPT = frozenset({"slicer", "preview"})
_GIB = 1 << 30


def option_tables(job_seconds: float, job_memory: float) -> Mapping[JobKind, OptionTable]:
    """The tables by kind; a job may take ``job_seconds``, its refining no more than that, and
    ``job_memory`` bytes."""

    def here(fields: tuple[OptionField, ...]) -> tuple[OptionField, ...]:
        return tuple(_here(one, job_seconds, job_memory) for one in fields if one.name not in _KEPT)

    return {
        JobKind.OCCLUDER: OptionTable(here(SIMPLIFY_FIELDS), _simplify_options),
        JobKind.EVALUATION: OptionTable(here(EVALUATE_FIELDS), _evaluate_options),
        JobKind.SCENE: OptionTable(here(SCENE_FIELDS), _scene_options),
        JobKind.TRADEOFF: OptionTable(here(TRADEOFF_FIELDS), _tradeoff_options),
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
    inside = chosen.get("conservative", False) or chosen.get("shrink", 0.0) > 0.0
    if not inside and chosen.get("error_bounds") is None and chosen.get("lods") is None:
        chosen = {**chosen, "lods": LEVELS}
    return _without_kept(asdict(SimplifyOptions.of(chosen)))


def _evaluate_options(chosen: dict[str, Any]) -> dict[str, Any]:
    return _without_kept(asdict(EvaluateOptions.of(chosen)))


def _scene_options(chosen: dict[str, Any]) -> dict[str, Any]:
    return {one.name: one.default for one in SCENE_FIELDS if one.name not in _KEPT} | chosen


def _tradeoff_options(chosen: dict[str, Any]) -> dict[str, Any]:
    return _without_kept(asdict(TradeoffOptions.of(chosen)))


def _without_kept(options: dict[str, Any]) -> dict[str, Any]:
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in options.items()
        if name not in _KEPT
    }
