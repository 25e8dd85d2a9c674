"""The rows of a sweep as CSV: one header, a row a setting, no comments; docs/tradeoff.md names the
columns."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from simplifier.report.machine import Machine
from simplifier.tradeoff.cases import Case, Judged
from simplifier.tradeoff.sweep import Outcome, SweepOptions
from simplifier.version import VERSION

COLUMNS = (
    "mesh", "budget", "setting", "preset", "resolution", "directions", "depths", "exchanges",
    "time", "moves", "ground", "up", "seed", "seconds", "seconds_min", "seconds_max", "repeats",
    "triangles", "precision", "recall", "standing", "dominated_by", "reason", "warnings",
    "version", "processor", "cores", "threads",
)  # fmt: skip
"""New ones go to the end; none changes its meaning."""


def table_bytes(
    found: Sequence[Outcome], cases: Sequence[Case], options: SweepOptions, machine: Machine
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


def _setting_cells(item: Judged, options: SweepOptions) -> dict[str, str]:
    setting = item.setting
    resolved = options.resolved(setting, 1.0)
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
        "warnings": "; ".join(outcome.trial.warnings),
        "dominated_by": "" if dominator is None else dominator.name,
    }


def _word(value: bool) -> str:
    return "yes" if value else "no"
