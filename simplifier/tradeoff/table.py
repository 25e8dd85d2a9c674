"""The rows of a sweep as CSV: one header, a row a setting, no comments; docs/tradeoff.md names the
columns.

The rows of a sweep as JSON: what the table says, in numbers; docs/tradeoff.md names the keys.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from typing import Any

from simplifier.options.tradeoff import TradeoffOptions
from simplifier.report.machine import Machine
from simplifier.tradeoff.cases import Case, Judged
from simplifier.tradeoff.sweep import Outcome, setting_options
from simplifier.version import VERSION

COLUMNS = (
    "mesh", "budget", "setting", "preset", "resolution", "directions", "depths", "exchanges",
    "time", "moves", "ground", "up", "seed", "seconds", "seconds_min", "seconds_max", "repeats",
    "triangles", "precision", "recall", "standing", "dominated_by", "reason", "warnings",
    "version", "processor", "cores", "threads", "overhang",
)  # fmt: skip
"""New ones go to the end; none changes its meaning."""


def tradeoff_csv(
    found: Sequence[Outcome], cases: Sequence[Case], options: TradeoffOptions, machine: Machine
) -> bytes:
    """UTF-8 CSV, lines end in LF, cells quoted where they must be; empty cells are unknown.

    ``found``  also has the meshes that could not be read; ``cases`` are made from it.
    """
    judged = {(case.mesh, item.setting): item for case in cases for item in case.judged}
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    common = {
        "ground": _word(options.ground), "up": options.up, "seed": options.seed,
        "version": VERSION, "processor": machine.processor, "cores": machine.cores,
        "threads": machine.threads,
    }  # fmt: skip
    for outcome in found:
        row = {"mesh": outcome.trial.mesh, "standing": "failed", "reason": outcome.trial.failure}
        if outcome.trial.setting is not None:
            item = judged[outcome.trial.mesh, outcome.trial.setting]
            row |= {**_setting_cells(item, options), **_figure_cells(item)}
        writer.writerow({**row, **common})
    return text.getvalue().encode("utf-8", "backslashreplace")


def _setting_cells(item: Judged, options: TradeoffOptions) -> dict[str, str]:
    setting = item.setting
    resolved = setting_options(options, setting, 1.0)
    return {
        "budget": str(setting.budget),
        "setting": setting.name,
        "preset": setting.preset,
        "resolution": str(resolved.solid.resolution),
        "directions": str(resolved.sections.directions),
        "depths": str(resolved.sections.depths),
        "exchanges": str(resolved.selection.exchanges),
        "time": "" if setting.time is None else f"{setting.time:g}",
        "moves": str(resolved.refine.moves) if setting.time is None else "",
        "standing": item.verdict,
    }


def _figure_cells(item: Judged) -> dict[str, str]:
    outcome = item.outcome
    if outcome.trial.failure:
        return {"repeats": str(outcome.repeats)}
    dominator = item.dominator.trial.setting if item.dominator else None
    return {
        "seconds": f"{outcome.trial.seconds:.6f}",
        "seconds_min": f"{outcome.seconds_min:.6f}",
        "seconds_max": f"{outcome.seconds_max:.6f}",
        "repeats": str(outcome.repeats),
        "triangles": str(outcome.trial.triangles),
        "precision": f"{outcome.trial.precision:.6f}",
        "recall": f"{outcome.trial.recall:.6f}",
        "overhang": f"{outcome.trial.overhang:.6f}",
        "warnings": "; ".join(outcome.trial.warnings),
        "dominated_by": "" if dominator is None else dominator.name,
    }


def _word(value: bool) -> str:
    return "yes" if value else "no"


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
        "overhang": trial.overhang,
        "dominated_by": dominator.name if dominator else None,
        "warnings": list(trial.warnings),
    }
