"""What got worse since a day: before, after, by how much, and the way to compare the two."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from datetime import datetime
from urllib.parse import urlencode

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from service.dashboard.frame import panel
from service.dashboard.overview.asset_lines import Change, Overview, midnight
from service.dashboard.wording import percent

_MOST = 50
"""Rows that are shown; the table's filter has all."""


class Worsened:
    """The panel: a date to choose, and a table."""

    def __init__(self, since: datetime, on_since: Callable[[datetime], Awaitable[None]]) -> None:
        self._on_since = on_since
        with panel("What got worse", titled=False):
            with ui.element("div").classes("row-of-controls"):
                ui.label("What got worse since").classes("panel-title").props(
                    "role=heading aria-level=2"
                )
                ui.input(value=since.date().isoformat(), on_change=self._choose).props(
                    'type=date dense outlined aria-label="Since"'
                ).classes("date")
            self._said = ui.label().classes("quiet").props("role=status")
            with ui.element("table").classes("plain-table") as self._table:
                _head(("Asset", ""), ("Before", "number"), ("Now", "number"), ("Fall", "number"))
                self._body = ui.element("tbody")

    def show(self, overview: Overview) -> None:
        changes, count = overview.worse[:_MOST], len(overview.worse)
        self._said.text = _summary(count)
        self._table.set_visibility(bool(changes))
        self._body.clear()
        with self._body:
            for change in changes:
                _rows(change)

    async def _choose(self, event: ValueChangeEventArguments[str | None]) -> None:
        try:
            since = midnight(event.value or "")
        except ValueError:  # half a date, while it is typed
            return
        await self._on_since(since)


def _summary(count: int) -> str:
    if count == 0:
        return "Nothing did."
    if count > _MOST:
        return f"{count:,} assets did; these fell most."
    return "1 asset did." if count == 1 else f"{count} assets did."


def _head(*columns: tuple[str, str]) -> None:
    with ui.element("thead"), ui.element("tr"):
        for title, kind in columns:
            with ui.element("th").props("scope=col").classes(kind):
                ui.label(title)


def _rows(change: Change) -> None:
    """One for each share that fell."""
    for word, pair in (("recall", change.recall), ("precision", change.precision)):
        if pair is not None:
            _row(change, word, pair)


def _row(change: Change, word: str, pair: tuple[float, float]) -> None:
    before, after = pair
    with ui.element("tr"):
        with ui.element("td"):
            ui.link(change.line.name, _comparison(change)).classes("name")
            ui.label(word).classes("quiet")
        for text in (percent(before, 2), percent(after, 2)):
            with ui.element("td").classes("number"):
                ui.label(text)
        with ui.element("td").classes("number bad"):
            ui.label(f"-{100.0 * (before - after):.2f}")


def _comparison(change: Change) -> str:
    assert change.line.latest is not None  # else nothing would have changed
    runs = {"a": change.before.job_id, "b": change.line.latest.job_id}
    return f"/compare?{urlencode(runs)}"
