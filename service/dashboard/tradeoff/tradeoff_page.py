"""The page of a trade-off."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.frame import page_frame, panel
from service.dashboard.tradeoff.chart import TradeoffChart
from service.dashboard.tradeoff.points import Tradeoff, tradeoff_of
from service.dashboard.tradeoff.points_table import show_points
from service.dashboard.tradeoff.sweep import SweepPanel
from service.dashboard.unknown import unknown_told
from service.dashboard.visitor import Visitor, current_visitor


@ui.page("/tradeoff/{asset_id}")
async def tradeoff_page(asset_id: str) -> None:
    visitor = current_visitor()
    with unknown_told():
        known = await run_sync(tradeoff_of, visitor, asset_id)
        with page_frame(f"Speed against accuracy: {known.asset}", here="/"):
            ui.link("See the asset", f"/assets/{known.asset_id}")
            _Page(visitor, known)


class _Page:
    """The panels, shown anew when a sweep has ended."""

    def __init__(self, visitor: Visitor, known: Tradeoff) -> None:
        self._visitor, self._asset_id = visitor, known.asset_id
        with ui.element("section").classes("panel") as self._drawn:
            self._chart = TradeoffChart(known)
        SweepPanel(visitor, known, self._renew)
        self._tables = ui.element("div").classes("live-jobs")
        self._show(known)

    async def _renew(self) -> None:
        known = await run_sync(tradeoff_of, self._visitor, self._asset_id)
        self._chart.show(known)
        self._tables.clear()
        self._show(known)

    def _show(self, known: Tradeoff) -> None:
        self._drawn.set_visibility(bool(known.runs or known.swept))
        with self._tables:
            if known.sweep:
                _measured(known)
            with panel("Runs"):
                if known.runs:
                    show_points("Runs", known.runs, known.precision, linked=True)
                else:
                    ui.label("No run of it has been judged yet.").classes("quiet")


def _measured(known: Tradeoff) -> None:
    with panel("What the sweep measured"):
        for line in known.advice:
            ui.label(line).classes("name")
        show_points("Settings of the sweep", known.swept, known.precision, linked=False)
        for name, reason in known.failed:
            ui.label(f"{name}: {reason}").classes("bad name")
        with ui.element("div").classes("row-of-controls"):
            ui.label(f"Measured on {known.machine}.").classes("quiet")
            for suffix in ("html", "csv", "json", "png"):
                link = f"/v1/jobs/{known.sweep}/files/tradeoff.{suffix}"
                ui.link(f"tradeoff.{suffix}", link)
