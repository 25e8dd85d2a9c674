"""The table of levels of detail on the HTML page about an occluder."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from simplifier.wording import length, percent

Report = Mapping[str, Any]

_COLUMNS = (
    "Level", "Triangles", "Recall", "Precision", "Error bound", "Deviation", "Voxels",
    "From distance", "File",
)  # fmt: skip


def levels(report: Report) -> str:
    """A section with a row a level and why others were left out; nothing for a single occluder."""
    if not report.get("levels"):
        return ""
    head = "".join(f"<th scope=col>{escape(column)}</th>" for column in _COLUMNS)
    rows = "".join(map(_row, report["levels"]))
    return (
        '<h2>Levels of detail</h2><div class="card"><table class="levels">'
        f"<tr>{head}</tr>{rows}</table>{_left_out(report)}</div>"
        '<p class="soft">All else on this page is about level 0.</p>'
    )


def _row(level: Report) -> str:
    cells = (
        f"{level['triangles']:,}",
        percent(level["recall"]),
        percent(level["precision"], 2),
        length(level["error_bound"]),
        length(level["deviation"]),
        f"{level['resolution']:,}",
        length(level["switch_distance"]),
        level["file"] or "not written",
    )
    shown = "".join(f"<td>{escape(str(cell))}</td>" for cell in cells)
    return f"<tr><th scope=row>{level['level']}</th>{shown}</tr>"


def _left_out(report: Report) -> str:
    items = "".join(
        f"<li>{one['resolution']:,} voxels: {escape(one['reason'])}</li>"
        for one in report["left_out"]
    )
    return f"<p>Left out:</p><ul>{items}</ul>" if items else ""
