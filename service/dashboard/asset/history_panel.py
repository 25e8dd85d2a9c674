"""The runs of an asset, to be opened and to be compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from urllib.parse import urlencode

from nicegui import ui

from service.dashboard.asset.details import RunLine
from service.dashboard.frame import panel
from service.dashboard.wording import percent, seconds, whole

_COLUMNS: list[dict[str, Any]] = [
    {"name": "when", "label": "Run (UTC)", "field": "when", "align": "left", "sortable": True},
    {"name": "recall", "label": "Recall", "field": "recall"},
    {"name": "precision", "label": "Precision", "field": "precision"},
    {"name": "worst", "label": "Worst view", "field": "worst"},
    {"name": "triangles", "label": "Triangles", "field": "triangles"},
    {"name": "time", "label": "Time", "field": "time"},
    {"name": "holds", "label": "Thresholds", "field": "holds", "align": "left"},
    {"name": "options", "label": "Options", "field": "options", "align": "left"},
    {"name": "version", "label": "Version", "field": "version", "align": "left"},
]
_HOLDS = {True: "held", False: "missed", None: ""}

# Ours; what comes from outside is filled in as text by Vue.
_WHEN = """<q-td :props="props"><a :href="props.row.address"
    :aria-current="props.row.shown ? 'true' : null">{{ props.value }}</a></q-td>"""
_VERDICT = """<q-td :props="props"><span
    :class="{ good: props.value === 'held', bad: props.value === 'missed' }">{{ props.value
    }}</span></q-td>"""
_OPTIONS = """<q-td :props="props" class="wrapping">{{ props.value }}</q-td>"""


def history_panel(asset_id: str, history: Sequence[RunLine], shown: str) -> None:
    """Newest first; ``shown`` is the run that the page is about."""
    with panel("History"):
        table = ui.table(
            rows=[_row(asset_id, line, shown) for line in history],
            columns=_COLUMNS,
            row_key="id",
            selection="multiple",
            pagination=10,
        ).props("dense flat")
        table.classes("history")
        table.add_slot("body-cell-when", _WHEN)
        table.add_slot("body-cell-holds", _VERDICT)
        table.add_slot("body-cell-options", _OPTIONS)
        words = ui.label().classes("quiet")
        compare = ui.button("Compare the two").props("no-caps unelevated")

        def choose() -> None:
            count = len(table.selected)
            compare.set_enabled(count == 2)
            words.set_text("" if count == 2 else "Choose two runs to compare them.")

        table.on_select(lambda _: choose())
        compare.on_click(lambda: ui.navigate.to(_comparison(history, table.selected)))
        choose()


def _comparison(history: Sequence[RunLine], selected: Sequence[dict[str, Any]]) -> str:
    """The older one first."""
    chosen = {row["id"] for row in selected}
    newer, older = (line.job_id for line in history if line.job_id in chosen)
    return f"/compare?{urlencode({'a': older, 'b': newer})}"


def _row(asset_id: str, line: RunLine, shown: str) -> dict[str, Any]:
    return {
        "id": line.job_id,
        "address": f"/assets/{asset_id}?{urlencode({'run': line.job_id})}",
        "shown": line.job_id == shown,
        "when": f"{line.created:%Y-%m-%d %H:%M:%S}",
        "recall": percent(line.recall),
        "precision": percent(line.precision, 2),
        "worst": percent(line.worst_recall),
        "triangles": whole(line.triangles),
        "time": seconds(line.seconds),
        "holds": _HOLDS[line.holds],
        "options": line.options,
        "version": line.version,
    }
