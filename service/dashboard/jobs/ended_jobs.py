"""Jobs that have ended, by how they did, page by page; failures explain themselves."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.jobs.job_lines import ENDED, EndedPage, JobLine, ended_page
from service.dashboard.jobs.job_parts import name_cells, show_failure
from service.dashboard.jobs.words import STATE_CLASSES, STATES
from service.dashboard.links import Address, keep_in_address
from service.dashboard.notices import showing_refusals, tell
from service.dashboard.plain_table import PlainTable
from service.dashboard.visitor import Visitor
from service.dashboard.wording import (
    VERDICT_CLASSES,
    moment,
    overhang,
    percent,
    seconds,
    whole,
)
from service.jobs.job import JobKind, JobState
from service.routes import actions

_RENEW_SECONDS = 3.0
_SELDOM = ("Overhang", "Triangles")
_LONGEST = 19  # digits of a cursor: the database's integers have 64 bits
_ALL = "all"
_CHOICES = {_ALL: "all that ended", **{str(state): STATES[state] for state in sorted(ENDED)}}


class EndedJobs:
    """The panel.  Its first page is kept up to date; older ones stand still.

    The address names the state that jobs ended in, and where a page of older ones begins.
    """

    def __init__(self, visitor: Visitor) -> None:
        self._visitor = visitor
        address = Address.of_page()
        state = address.one_of("state", _CHOICES, _ALL)
        self._states = _states_of(state)
        self._cursors: list[int | None] = [None]  # of the pages up to the one that is shown
        if before := _whole(address.text("before")):
            self._cursors.append(before)
        self._page: EndedPage | None = None
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("row-of-controls"):
                ui.label("Ended").classes("panel-title").props("role=heading aria-level=2")
                ui.space()
                ui.select(
                    _CHOICES, value=state, label="Show",
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
        ui.timer(_RENEW_SECONDS, self._renew)

    async def load(self) -> None:
        """Show what there is now."""
        with showing_refusals():
            page = await run_sync(ended_page, self._visitor, self._states, self._cursors[-1])
            if page != self._page:
                self._page = page
                self._build(page)

    async def _renew(self) -> None:
        if len(self._cursors) == 1:
            await self.load()

    async def _choose(self, state: str) -> None:
        self._states, self._cursors = _states_of(state), [None]
        keep_in_address(state=None if state == _ALL else state)
        await self._turn()

    async def _go_older(self) -> None:
        if self._page and self._page.cursor is not None:
            self._cursors.append(self._page.cursor)
            await self._turn()

    async def _go_newer(self) -> None:
        if len(self._cursors) > 1:
            self._cursors.pop()
            await self._turn()

    async def _turn(self) -> None:
        keep_in_address(before=self._cursors[-1])
        await self.load()

    def _build(self, page: EndedPage) -> None:
        self._newer.set_visibility(len(self._cursors) > 1)
        self._older.set_visibility(page.cursor is not None)
        self._body.clear()
        with self._body:
            if not page.lines:
                chosen = self._states != ENDED or len(self._cursors) > 1
                words = "No jobs match this filter." if chosen else "No jobs have ended yet."
                ui.label(words).classes("quiet")
                return
            columns = ["Mesh", "Asset", "Kind", "State", "Verdict", "#Precision", "#Recall",
                       "#Overhang", "#Triangles", "#Run time", "Ended", ""]  # fmt: skip
            with ui.element("div").classes("wide-table"):
                table = PlainTable("Jobs that have ended", columns, seldom=_SELDOM)
            for line in page.lines:
                self._row(table, line, len(columns))

    def _row(self, table: PlainTable, line: JobLine, columns: int) -> None:
        done = line.state is JobState.SUCCEEDED
        with table.row():
            name_cells(table, line)
            table.text(STATES[line.state], STATE_CLASSES[line.state])
            table.text(line.verdict or "", VERDICT_CLASSES.get(line.verdict or "", ""))
            table.number(percent(line.precision) if done else "")
            table.number(percent(line.recall) if done else "")
            table.number(overhang(line.overhang) if done else "")
            counted = done and line.kind is not JobKind.VISIBILITY
            table.number(whole(line.triangles) if counted else "")
            table.number(seconds(line.seconds) if done else "")
            table.text(moment(line.ended or line.created), "moment")
            with table.cell() as cell:
                if not done:
                    retry_button(self._visitor, line)
            cell.classes("button-cell")
        if line.state is JobState.FAILED:
            with table.row(), table.cell() as cell:
                show_failure(line)
            cell.props(f"colspan={columns}").classes("reason-cell")


def retry_button(visitor: Visitor, line: JobLine) -> None:
    """Do a job again that failed or was cancelled; opens the new one."""

    async def again() -> None:
        def retry() -> str:
            caller = visitor.caller(Scope.WRITE)
            return actions.retry(visitor.services, caller, line.id).id

        with showing_refusals():
            new = await run_sync(retry)
            tell("The job was submitted again")
            ui.navigate.to(f"/jobs/{new}")

    button = ui.button("Retry", on_click=again).props("no-caps flat dense")
    button.props["aria-label"] = f"Retry {line.name}"


def _whole(text: str) -> int | None:
    """A cursor that an address names, which anybody may have changed."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < _LONGEST else None


def _states_of(state: str) -> frozenset[JobState]:
    return frozenset([JobState(state)]) if state in list(ENDED) else ENDED
