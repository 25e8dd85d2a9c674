"""The page of a trade-off: what is known, and a sweep to be run, that runs, or that has run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.frame import page_frame, panel
from service.dashboard.jobs.job_lines import JobLine
from service.dashboard.jobs.live_job import LiveJob
from service.dashboard.notices import showing_refusals, showing_unknown
from service.dashboard.submit.option_form import OptionForm
from service.dashboard.tradeoff.chart import TradeoffChart, show_points
from service.dashboard.tradeoff.points import Tradeoff, tradeoff_of
from service.dashboard.visitor import Visitor, current_visitor
from service.jobs.job import JobKind
from service.routes import actions

QUICK_SECONDS = 50
"""Of the quick sweep: with reading the mesh and drawing the result it is under a minute."""

_BUDGET = 64  # where no run says another


@ui.page("/tradeoff/{asset_id}")
async def tradeoff_page(asset_id: str) -> None:
    visitor = current_visitor()
    with showing_unknown():
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
                _show_measured(known)
            with panel("Runs"):
                if known.runs:
                    show_points("Runs", known.runs, known.precision, linked=True)
                else:
                    ui.label("No run of this asset has been measured yet.").classes("quiet")


def _show_measured(known: Tradeoff) -> None:
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


def quick_options(budget: int) -> dict[str, Any]:
    """The presets, and a step of each knob, once each."""
    return {
        "budgets": [budget], "resolutions": [32], "directions": [16], "times": [0.5, 2.0],
        "repeats": 1, "within": float(QUICK_SECONDS),
    }  # fmt: skip


class SweepPanel:
    """``on_measured`` is awaited when a sweep has ended."""

    def __init__(
        self, visitor: Visitor, known: Tradeoff, on_measured: Callable[[], Awaitable[None]]
    ) -> None:
        self._visitor, self._asset_id = visitor, known.asset_id
        self._on_measured = on_measured
        with panel("Sweep"):
            self._budget = known.budget or _BUDGET
            ui.label(
                f"The quick sweep tries the presets and a few settings once each, at {self._budget}"
                f" triangles. It ends within {QUICK_SECONDS} seconds and shows what was measured "
                "by then. Each run is kept as soon as it is measured, even if the service stops."
            ).classes("option-help")
            with ui.element("div").classes("row-of-controls"):
                self._quick = ui.button("Run the quick sweep", on_click=self._run_quick)
                self._quick.props("no-caps unelevated")
            with ui.expansion("Choose the settings").classes("more-settings") as chosen:
                chosen.props('dense expand-separator header-class="panel-title"')
                ui.label(
                    "Runs every setting at every budget, as often as Repeats says. This takes "
                    "minutes."
                ).classes("option-help")
                self._form = OptionForm(visitor.services.tables[JobKind.TRADEOFF])
                if known.budget is not None:
                    self._form.fill({"budgets": str(known.budget), "repeats": "1"})
                self._button = ui.button("Run the sweep", on_click=self._run)
                self._button.props("no-caps outline")
        self._place = ui.element("div").classes("live-jobs")
        if known.going:
            self._follow(known.going)

    async def _run(self) -> None:
        form = self._form.read()
        if form.faults:
            self._form.show_faults(form)
            return

        await self._sweep(form.resolved)

    async def _run_quick(self) -> None:
        await self._sweep(quick_options(self._budget))

    async def _sweep(self, options: Mapping[str, Any]) -> None:
        def sweep() -> str:
            caller = self._visitor.caller(Scope.WRITE)
            services = self._visitor.services
            return actions.sweep(services, caller, self._asset_id, options).id

        with showing_refusals():
            self._follow(await run_sync(sweep))

    def _follow(self, job_id: str) -> None:
        self._button.disable()
        self._quick.disable()
        self._place.clear()
        with self._place:
            LiveJob(self._visitor, job_id, self._hear_end)

    async def _hear_end(self, _: JobLine) -> None:
        self._button.enable()
        self._quick.enable()
        await self._on_measured()
