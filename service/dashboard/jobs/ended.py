"""Jobs that have ended, by how they did, page by page; failures explain themselves."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.jobs.outcome import show_failure
from service.dashboard.jobs.rows import ENDED, EndedPage, JobLine, ended_page
from service.dashboard.jobs.tables import link_cell, number_cell, table, text_cell
from service.dashboard.jobs.words import (
    KINDS,
    STATE_CLASSES,
    STATES,
    moment_words,
    percent,
    seconds_words,
)
from service.dashboard.notices import refusals_told, tell
from service.dashboard.session import Visitor
from service.jobs.job import JobState
from service.routes import actions

_SECONDS = 3.0
_ALL = "all"
_CHOICES = {_ALL: "all that ended", **{str(state): STATES[state] for state in sorted(ENDED)}}


class EndedJobs:
    """The panel.  Its first page is kept up to date; older ones stand still."""

    def __init__(self, visitor: Visitor, state: str) -> None:
        self._visitor = visitor
        self._states = _chosen(state)
        self._cursors: list[int | None] = [None]  # of the pages up to the one that is shown
        self._page: EndedPage | None = None
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("row-of-controls"):
                ui.label("Ended").classes("panel-title").props("role=heading aria-level=2")
                ui.space()
                ui.select(
                    _CHOICES, value=state if state in _CHOICES else _ALL, label="Show",
                    on_change=lambda event: self._choose(event.value),
                ).props("dense outlined options-dense").classes("state-choice")  # fmt: skip
            self._body = ui.element("div")
            with ui.element("div").classes("row-of-controls"):
                self._newer = ui.button("Newer", on_click=self._go_newer).props(
                    "no-caps flat dense"
                )
                self._older = ui.button("Older", on_click=self._go_older).props(
                    "no-caps flat dense"
                )
        ui.timer(_SECONDS, self._renew)

    async def load(self) -> None:
        """Show what there is now."""
        with refusals_told():
            page = await run_sync(ended_page, self._visitor, self._states, self._cursors[-1])
            if page != self._page:
                self._page = page
                self._build(page)

    async def _renew(self) -> None:
        if len(self._cursors) == 1:
            await self.load()

    async def _choose(self, state: str) -> None:
        self._states, self._cursors = _chosen(state), [None]
        await self.load()

    async def _go_older(self) -> None:
        if self._page and self._page.cursor is not None:
            self._cursors.append(self._page.cursor)
            await self.load()

    async def _go_newer(self) -> None:
        if len(self._cursors) > 1:
            self._cursors.pop()
            await self.load()

    def _build(self, page: EndedPage) -> None:
        self._newer.set_visibility(len(self._cursors) > 1)
        self._older.set_visibility(page.cursor is not None)
        self._body.clear()
        with self._body:
            if not page.lines:
                ui.label("None has ended so.").classes("quiet")
                return
            heads = ("Mesh", "Asset", "Kind", "State", "Precision", "Recall", "Triangles", "Time",
                     "Ended, UTC", "")  # fmt: skip
            with table("Jobs that have ended", heads, frozenset({4, 5, 6, 7})):
                for line in page.lines:
                    self._row(line)

    def _row(self, line: JobLine) -> None:
        done = line.state is JobState.SUCCEEDED
        with ui.element("tr"):
            link_cell(line.name, f"/jobs/{line.id}")
            if line.asset_id:
                link_cell(line.asset or "", f"/assets/{line.asset_id}")
            else:
                text_cell("-", "quiet")
            text_cell(KINDS[line.kind])
            text_cell(STATES[line.state], STATE_CLASSES[line.state])
            number_cell(percent(line.precision, 2) if done else "")
            number_cell(percent(line.recall) if done else "")
            number_cell(f"{line.triangles:,}" if line.triangles is not None else "")
            number_cell(seconds_words(line.seconds) if done else "")
            text_cell(moment_words(line.ended or line.created), "number-left")
            with ui.element("td").classes("button-cell"):
                if not done:
                    retry_button(self._visitor, line)
        if line.state is JobState.FAILED:
            with ui.element("tr"), ui.element("td").props("colspan=10").classes("reason-cell"):
                show_failure(line)


def retry_button(visitor: Visitor, line: JobLine) -> None:
    """Do a job again that failed or was cancelled; opens the new one."""

    async def again() -> None:
        def retry() -> str:
            caller = visitor.caller(Scope.WRITE)
            return actions.retry(visitor.services, caller, line.id).id

        with refusals_told():
            new = await run_sync(retry)
            tell("The job is done again")
            ui.navigate.to(f"/jobs/{new}")

    ui.button("Retry", on_click=again).props("no-caps flat dense")


def _chosen(state: str) -> frozenset[JobState]:
    return frozenset([JobState(state)]) if state in list(ENDED) else ENDED
