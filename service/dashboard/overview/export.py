"""Assets as a file for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from datetime import UTC, datetime

from service.dashboard.overview.asset_lines import AssetLine

_COLUMNS = (
    "asset", "precision", "recall", "worst_recall", "worst_view", "input_triangles", "triangles",
    "seconds", "min_precision", "min_recall", "thresholds", "latest_run", "asset_id",
)  # fmt: skip
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def csv_of(lines: Iterable[AssetLine]) -> str:
    """One row an asset; shares are 0 to 1, times ISO 8601 UTC, empty where there is no run."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(_COLUMNS)
    writer.writerows(_row(line) for line in lines)
    return text.getvalue()


def harmless(text: str) -> str:
    """With an apostrophe before what a spreadsheet would take for a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def _row(line: AssetLine) -> list[object]:
    run, demanded = line.latest, line.thresholds
    numbers: list[object] = [None] * 7
    created = None
    if run is not None:
        numbers = [
            run.precision, run.recall, run.worst_recall, run.worst_view, run.input_triangles,
            run.triangles, run.seconds,
        ]  # fmt: skip
        created = datetime.fromtimestamp(run.created, UTC).isoformat(timespec="seconds")
    return [
        harmless(line.name), *numbers, demanded.min_precision, demanded.min_recall, line.verdict,
        created and created.replace("+00:00", "Z"), line.id,
    ]  # fmt: skip
