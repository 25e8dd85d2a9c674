"""The page of all assets: which are good enough, how they spread, which got worse."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from nicegui import run, ui

from service.access.key import Scope
from service.dashboard.frame import page_frame, panel
from service.dashboard.overview.asset_lines import AssetLine, Overview, summary
from service.dashboard.overview.beginning import beginning
from service.dashboard.overview.charts import Distribution
from service.dashboard.overview.export import csv_of
from service.dashboard.overview.exports import rows_address
from service.dashboard.overview.sharing import shared_overview
from service.dashboard.overview.table import AssetsTable
from service.dashboard.overview.thresholds_dialog import open_demand
from service.dashboard.overview.worsened import Worsened
from service.dashboard.visitor import Visitor, current_caller, current_visitor
from service.errors import ServiceError, UnauthenticatedError

_WEEK = timedelta(days=7)
_LOOK_SECONDS = 4.0
"""Between two looks for new results."""


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
                    editable=current_caller().may(Scope.WRITE),
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
        """In a thread."""
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
        """In the order in which they are shown."""
        lines = {line.id: line for line in self._lines}
        chosen = (lines[one] for one in asset_ids if one in lines)
        ui.download.content(csv_of(chosen), "assets.csv", "text/csv")

    @property
    def _lines(self) -> tuple[AssetLine, ...]:
        return self._overview.lines if self._overview else ()
