"""The page of all assets: which are good enough, how they spread, which got worse.

Where there is none yet it says what to do first.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime, timedelta
from urllib.parse import urlencode

from nicegui import run, ui
from nicegui.events import ValueChangeEventArguments

from service.dashboard.frame import page_frame, panel
from service.dashboard.overview.asset_lines import (
    AssetLine,
    Change,
    Overview,
    midnight,
    shared_overview,
    summary,
)
from service.dashboard.overview.charts import AssetsTable, Distribution
from service.dashboard.overview.exports import csv_of, rows_address
from service.dashboard.overview.thresholds_dialog import open_demand
from service.dashboard.visitor import Visitor, current_caller, current_visitor
from service.dashboard.wording import percent
from service.errors import ServiceError, UnauthenticatedError

_WEEK = timedelta(days=7)
_LOOK_SECONDS = 4.0
"""Between two looks for new results."""

_MOST_ROWS = 50
"""Rows that are shown; the table's filter has all."""


@ui.page("/")
def overview_page() -> None:
    with page_frame("Overview", here="/"):
        _Page(current_visitor())


class _Page:
    """The panels of one open page, and what they show."""

    def __init__(self, visitor: Visitor) -> None:
        self._visitor = visitor
        self._overview: Overview | None = None
        self._shown = 0
        self._since = datetime.now(UTC).replace(hour=0, minute=0, second=0, microsecond=0) - _WEEK
        settings, request = visitor.services.settings, ui.context.client.request
        self._figures = ui.label("Loading").classes("quiet").props("role=status")
        self._beginning = beginning(
            settings.public_url or str(request.base_url).rstrip("/"), keyed=settings.keys_needed
        )
        self._panels = ui.element("div").classes("stacked")
        with self._panels:
            with panel("Assets", titled=False):
                self._table = AssetsTable(
                    editable=current_caller().may_curate,
                    on_demand=self._demand,
                    on_export=self._export,
                )
            with ui.element("div").classes("side-by-side"):
                with panel("Precision against recall"):
                    self._distribution = Distribution()
                self._worsened = Worsened(self._since, self._choose_since)
        self._beginning.visible = self._panels.visible = False
        ui.timer(_LOOK_SECONDS, self._look)

    async def _look(self) -> None:
        """Show what is new, if anything is."""
        try:
            overview = await run.io_bound(self._read)
        except UnauthenticatedError:
            ui.navigate.reload()
        except ServiceError as refusal:
            self._figures.text = f"These numbers may be old: {refusal.detail}."
        else:
            if overview not in (None, self._overview) and overview.since == self._since:
                self._show(overview)

    def _read(self) -> Overview:
        """Read what there is now; called in a thread."""
        tenant = self._visitor.caller().tenant
        return shared_overview(self._visitor.services.assets, tenant, self._since)

    def _show(self, overview: Overview) -> None:
        self._overview = overview
        self._shown += 1
        source = rows_address(overview.since, self._shown)
        self._figures.text = summary(overview)
        self._panels.visible = bool(overview.lines)
        self._beginning.visible = not overview.lines
        self._table.show(source)
        self._distribution.show(source)
        self._worsened.show(overview)

    async def _choose_since(self, since: datetime) -> None:
        self._since = since
        await self._look()

    def _demand(self, asset_id: str) -> None:
        line = next((one for one in self._lines if one.id == asset_id), None)
        if line is not None:
            open_demand(self._visitor, line, self._look)

    def _export(self, asset_ids: Sequence[str]) -> None:
        """Send a table of the assets, in the order in which they are shown."""
        lines = {line.id: line for line in self._lines}
        chosen = (lines[one] for one in asset_ids if one in lines)
        ui.download.content(csv_of(chosen), "assets.csv", "text/csv")

    @property
    def _lines(self) -> tuple[AssetLine, ...]:
        return self._overview.lines if self._overview else ()


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
                _head(("Asset", ""), ("Before", "number"), ("Now", "number"), ("Change", "number"))
                self._body = ui.element("tbody")

    def show(self, overview: Overview) -> None:
        changes, count = overview.worse[:_MOST_ROWS], len(overview.worse)
        self._said.text = _count_words(count)
        self._table.set_visibility(bool(changes))
        self._body.clear()
        with self._body:
            for change in changes:
                _change_rows(change)

    async def _choose(self, event: ValueChangeEventArguments[str | None]) -> None:
        try:
            since = midnight(event.value or "")
        except ValueError:  # half a date, while it is typed
            return
        await self._on_since(since)


def _count_words(count: int) -> str:
    if count == 0:
        return "Nothing did."
    if count > _MOST_ROWS:
        return f"{count:,} assets did; these most."
    return "1 asset did." if count == 1 else f"{count} assets did."


def _head(*columns: tuple[str, str]) -> None:
    with ui.element("thead"), ui.element("tr"):
        for title, kind in columns:
            with ui.element("th").props("scope=col").classes(kind):
                ui.label(title)


def _change_rows(change: Change) -> None:
    """Add a row for each share that got worse."""
    for word, pair in (
        ("recall", change.recall), ("precision", change.precision), ("overhang", change.overhang),
    ):  # fmt: skip
        if pair is not None:
            _change_row(change, word, pair)


def _change_row(change: Change, word: str, pair: tuple[float, float]) -> None:
    before, after = pair
    with ui.element("tr"):
        with ui.element("td"):
            ui.link(change.line.name, _comparison(change)).classes("name")
            ui.label(word).classes("quiet")
        for text in (percent(before, 2), percent(after, 2)):
            with ui.element("td").classes("number"):
                ui.label(text)
        with ui.element("td").classes("number bad"):
            ui.label(f"{100.0 * (after - before):+.2f}")


def _comparison(change: Change) -> str:
    assert change.line.latest is not None  # else nothing would have changed
    runs = {"a": change.before.job_id, "b": change.line.latest.job_id}
    return f"/compare?{urlencode(runs)}"


def beginning(address: str, *, keyed: bool) -> ui.element:
    """The panel; ``address`` is the service's as it was asked for, ``keyed`` if it needs keys."""
    key = ' -H "X-API-Key: $OCCLUDER_KEY"' if keyed else ""
    command = (
        f"curl --data-binary @castle.glb{key} \\\n"
        f'  "{address}/v1/occluders?filename=castle.glb&asset=props/castle"'
    )
    with ui.element("section").classes("panel beginning") as panel:
        ui.label("No asset yet").classes("panel-title").props("role=heading aria-level=2")
        ui.label(
            "An asset is a name for a mesh and its runs. Send a mesh, and it appears here with its "
            "precision and recall; send it again after a change, and its history begins."
        )
        with ui.element("div").classes("row-of-controls"):
            ui.link("Submit a mesh", "/submit").classes("button-link")
            ui.label("or from a shell:").classes("quiet")
        with ui.element("pre").classes("command"):
            ui.label(command)
    return panel
