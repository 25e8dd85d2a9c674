"""The settings of a sweep, the button that runs it, and the sweep that runs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.frame import panel
from service.dashboard.jobs.job_lines import JobLine
from service.dashboard.jobs.live_job import LiveJob
from service.dashboard.notices import refusals_told, warn
from service.dashboard.submit.option_form import OptionForm
from service.dashboard.tradeoff.points import Tradeoff
from service.dashboard.visitor import Visitor
from service.jobs.job import JobKind
from service.routes import actions


class SweepPanel:
    """``on_measured`` is awaited when a sweep has ended."""

    def __init__(
        self, visitor: Visitor, known: Tradeoff, on_measured: Callable[[], Awaitable[None]]
    ) -> None:
        self._visitor, self._asset_id = visitor, known.asset_id
        self._on_measured = on_measured
        with panel("Sweep"):
            ui.label(
                "Runs many settings on the mesh of the latest run, times and judges each. It takes "
                "minutes: settings x budgets x repeats."
            ).classes("option-help")
            self._form = OptionForm(visitor.services.tables[JobKind.TRADEOFF])
            if known.budget is not None:
                self._form.fill({"budgets": str(known.budget), "repeats": "1"})
            self._button = ui.button("Run the sweep", on_click=self._run)
            self._button.props("no-caps unelevated")
        self._place = ui.element("div").classes("live-jobs")
        if known.going:
            self._follow(known.going)

    async def _run(self) -> None:
        form = self._form.read()
        if form.faults:
            self._form.show_faults(form)
            warn("Some settings are wrong; see beside them")
            return

        def sweep() -> str:
            caller = self._visitor.caller(Scope.WRITE)
            services = self._visitor.services
            return actions.sweep(services, caller, self._asset_id, form.resolved).id

        with refusals_told():
            self._follow(await run_sync(sweep))

    def _follow(self, job_id: str) -> None:
        self._button.disable()
        self._place.clear()
        with self._place:
            LiveJob(self._visitor, job_id, self._ended)

    async def _ended(self, _: JobLine) -> None:
        self._button.enable()
        await self._on_measured()
