"""The table of all assets."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import nicegui
from nicegui.element import Element

from service.dashboard.overview.rows import AssetLine, Overview, Verdict

_GRID = Path(nicegui.__file__).parent / "elements" / "aggrid" / "dist"

_URGENCY = {
    Verdict.MISSED: 0,
    Verdict.NEVER_RUN: 1,
    Verdict.OPEN: 2,
    Verdict.HELD: 2,
}

Row = Mapping[str, Any]


class AssetsTable(Element, component="assets_table.js", esm={"nicegui-aggrid": str(_GRID)}):
    """Rows live in the browser, which filters and sorts them; only what has changed is sent.

    ``editable``  whether to offer setting thresholds.
    """

    def __init__(
        self,
        *,
        editable: bool,
        on_demand: Callable[[str], None],
        on_export: Callable[[Sequence[str]], None],
    ) -> None:
        super().__init__()
        self._props["editable"] = editable
        self._ready = False
        self._rows: Mapping[str, Row] = {}
        self.on("ready", self._begin)
        self.on("demand", lambda event: on_demand(str(event.args)))
        self.on("export", lambda event: on_export([str(one) for one in event.args]))

    def show(self, overview: Overview) -> None:
        before, self._rows = self._rows, rows_of(overview)
        if self._ready and self._rows != before:
            self.run_method("changeRows", difference(before, self._rows))

    def _begin(self) -> None:
        self._ready = True
        self.run_method("setRows", list(self._rows.values()))


@lru_cache(maxsize=4)
def rows_of(overview: Overview) -> Mapping[str, Row]:
    """By asset id, those that miss their thresholds first; shared by all pages that show it."""
    worse = {change.line.id for change in overview.worse}
    urgent_first = sorted(overview.lines, key=lambda line: _URGENCY[line.verdict])
    return {line.id: row_of(line, worse) for line in urgent_first}


def row_of(line: AssetLine, worse: Collection[str]) -> Row:
    """What the browser is told of an asset: its name, and numbers."""
    run = line.latest
    return {
        "id": line.id,
        "name": line.name,
        "verdict": str(line.verdict),
        "precision": run and run.precision,
        "recall": run and run.recall,
        "recalls": [round(recall, 4) for recall in line.recalls],
        "worst": run and run.worst_recall,
        "worstView": run and run.worst_view,
        "input": run and run.input_triangles,
        "triangles": run and run.triangles,
        "seconds": run and run.seconds,
        "created": run and run.created,
        "worse": line.id in worse,
    }


def difference(old: Mapping[str, Row], new: Mapping[str, Row]) -> Mapping[str, Sequence[Row]]:
    """What makes the old rows the new ones, as the grid has it."""
    return {
        "add": [row for key, row in new.items() if key not in old],
        "update": [row for key, row in new.items() if key in old and old[key] != row],
        "remove": [{"id": key} for key in old if key not in new],
    }
