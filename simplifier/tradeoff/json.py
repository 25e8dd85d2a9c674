"""The rows of a sweep as JSON: what the table says, in numbers; docs/tradeoff.md names the keys."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from simplifier.report.machine import Machine
from simplifier.tradeoff.cases import Case, Judged
from simplifier.tradeoff.sweep import Outcome

SCHEMA_VERSION = 1


def rows_of(found: Sequence[Outcome], cases: Sequence[Case]) -> list[dict[str, Any]]:
    """A row a setting, in the order in which they ran; None where something is not known."""
    judged = {(case.mesh, item.setting): item for case in cases for item in case.judged}
    return [
        _unread(outcome)
        if outcome.trial.setting is None
        else _row(judged[outcome.trial.mesh, outcome.trial.setting])
        for outcome in found
    ]


def json_bytes(
    rows: Sequence[dict[str, Any]], precision: float, machine: Machine, lines: Sequence[str]
) -> bytes:
    """UTF-8; ``lines`` is the advice in words."""
    document = {
        "schema_version": SCHEMA_VERSION,
        "precision": precision,
        "machine": str(machine),
        "advice": list(lines),
        "settings": list(rows),
    }
    return (json.dumps(document, indent=2, allow_nan=False) + "\n").encode()


def _unread(outcome: Outcome) -> dict[str, Any]:
    return {"mesh": outcome.trial.mesh, "standing": "failed", "reason": outcome.trial.failure}


def _row(item: Judged) -> dict[str, Any]:
    outcome, setting = item.outcome, item.setting
    trial = outcome.trial
    named: dict[str, Any] = {
        "mesh": trial.mesh,
        "budget": setting.budget,
        "setting": setting.name,
        "preset": setting.preset,
        "resolution": setting.resolution,
        "directions": setting.directions,
        "time": setting.time,
        "standing": item.verdict,
    }
    if trial.failure:
        return {**named, "reason": trial.failure}
    dominator = item.dominator.trial.setting if item.dominator else None
    return {
        **named,
        "seconds": trial.seconds,
        "seconds_min": outcome.seconds_min,
        "seconds_max": outcome.seconds_max,
        "repeats": outcome.repeats,
        "triangles": trial.triangles,
        "precision": trial.precision,
        "recall": trial.recall,
        "dominated_by": dominator.name if dominator else None,
        "warnings": list(trial.warnings),
    }
