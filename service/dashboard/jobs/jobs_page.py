"""The page of all jobs: what runs, with its progress, and what waits, with its place.

Both are kept up to date; what has ended is a panel of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anyio.to_thread import run_sync
from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from service.access.key import Scope
from service.dashboard.frame import page_frame, panel
from service.dashboard.jobs.ended_jobs import EndedJobs
from service.dashboard.jobs.job_lines import JobLine, JobsNow, jobs_now
from service.dashboard.jobs.job_parts import name_cells
from service.dashboard.notices import showing_refusals
from service.dashboard.plain_table import PlainTable
from service.dashboard.visitor import Visitor, current_visitor
from service.dashboard.wording import moment, percent, seconds
from service.routes import actions

_RENEW_SECONDS = 1.0


@ui.page("/jobs")
async def jobs_page() -> None:
    visitor = current_visitor()
    now = await run_sync(jobs_now, visitor)
    with page_frame("Jobs", here="/jobs"):
        WaitingJobs(visitor, now)
        await EndedJobs(visitor).load()


@dataclass(frozen=True)
class _Shown:
    """The parts of a row that change."""

    bar: ui.linear_progress
    share: TextElement
    stage: TextElement
    seconds: TextElement

    def show(self, line: JobLine) -> None:
        self.bar.value = round(line.fraction, 3)
        self.share.text = percent(line.fraction, 0)
        self.stage.text = line.stage or "starting"
        self.seconds.text = seconds(line.seconds)


class WaitingJobs:
    """Two panels; rows are made anew only where jobs come or go, so that the focus stays."""

    def __init__(self, visitor: Visitor, now: JobsNow) -> None:
        self._visitor, self._now = visitor, now
        self._rows: dict[str, _Shown] = {}
        self._running = _body("Running")
        self._queued = _body("Queue")
        self._build(now)
        ui.timer(_RENEW_SECONDS, self._renew)

    async def _renew(self) -> None:
        with showing_refusals():
            now = await run_sync(jobs_now, self._visitor)
            before, self._now = self._now, now
            if _ids(now.running) != _ids(before.running) or _places(now) != _places(before):
                self._build(now)
            else:
                for line in now.running:
                    self._rows[line.id].show(line)

    def _build(self, now: JobsNow) -> None:
        self._rows.clear()
        self._running.clear()
        with self._running:
            self._build_running(now.running)
        self._queued.clear()
        with self._queued:
            self._build_queue(now.queued)

    def _build_running(self, lines: Sequence[JobLine]) -> None:
        if not lines:
            ui.label("No jobs are running.").classes("quiet")
            return
        columns = ["Mesh", "Asset", "Kind", "Progress", "#", "Stage", "#Run time", ""]
        with ui.element("div").classes("wide-table"):
            table = PlainTable("Jobs that run", columns)
        for line in lines:
            with table.row():
                name_cells(table, line)
                with table.cell() as cell:
                    bar = ui.linear_progress(0.0, show_value=False, size="8px")
                    bar.props('aria-label="Progress" instant-feedback')
                cell.classes("bar-cell")
                shown = _Shown(bar, table.number(""), table.text("", "quiet"), table.number(""))
                shown.show(line)
                self._rows[line.id] = shown
                self._end_cell(table, line)

    def _build_queue(self, lines: Sequence[JobLine]) -> None:
        if not lines:
            ui.label("No jobs are waiting.").classes("quiet")
            return
        columns = ["Mesh", "Asset", "Kind", "#Place", "Sent", ""]
        with ui.element("div").classes("wide-table"):
            table = PlainTable("Jobs that wait", columns)
        for line in lines:
            with table.row():
                name_cells(table, line)
                table.number(f"{line.place:,}")
                table.text(moment(line.created), "moment")
                self._end_cell(table, line)

    def _end_cell(self, table: PlainTable, line: JobLine) -> None:
        async def end() -> None:
            def cancel() -> None:
                caller = self._visitor.caller(Scope.WRITE)
                actions.cancel(self._visitor.services, caller, line.id)

            button.disable()
            with showing_refusals():
                await run_sync(cancel)

        with table.cell() as cell:
            button = ui.button("Cancel", on_click=end).props("no-caps flat dense")
            button.props["aria-label"] = f"Cancel {line.name}"
        cell.classes("button-cell")


def _body(title: str) -> ui.element:
    """What a panel holds under its heading."""
    with panel(title):
        return ui.element("div")


def _ids(lines: Sequence[JobLine]) -> list[str]:
    return [line.id for line in lines]


def _places(now: JobsNow) -> list[tuple[str, int | None]]:
    return [(line.id, line.place) for line in now.queued]
