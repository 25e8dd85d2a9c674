"""How all assets spread: precision against recall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import nicegui
from nicegui.element import Element

from service.dashboard.overview.rows import Overview, Verdict

_CHART = Path(nicegui.__file__).parent / "elements" / "echart" / "dist"

Point = Mapping[str, Any]


class Distribution(Element, component="distribution.js", esm={"nicegui-echart": str(_CHART)}):
    """One point an asset that has both shares; a click opens it."""

    def __init__(self) -> None:
        super().__init__()
        self._ready = False
        self._points: Sequence[Point] = ()
        self.on("ready", self._begin)

    def show(self, overview: Overview) -> None:
        before, self._points = self._points, points_of(overview)
        if self._ready and self._points != before:
            self._send()

    def _begin(self) -> None:
        self._ready = True
        self._send()

    def _send(self) -> None:
        self.run_method("setPoints", self._points)


@lru_cache(maxsize=4)
def points_of(overview: Overview) -> Sequence[Point]:
    """Shared by all pages that show the same."""
    return [
        {
            "id": line.id,
            "name": line.name,
            "precision": line.latest.precision,
            "recall": line.latest.recall,
            "missed": line.verdict is Verdict.MISSED,
        }
        for line in overview.lines
        if line.latest is not None
        and line.latest.precision is not None
        and line.latest.recall is not None
    ]
