"""A job that is followed on a page: how far it is, its end, and the way to end it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.jobs.best_so_far import BestPicture, MeasureLine
from service.dashboard.jobs.job_lines import JobLine, job_line, progress_words
from service.dashboard.jobs.job_parts import show_outcome
from service.dashboard.jobs.words import STATE_CLASSES, STATES
from service.dashboard.notices import showing_refusals
from service.dashboard.visitor import Visitor
from service.dashboard.wording import percent, seconds
from service.errors import NotFoundError
from service.jobs.job import JobKind, JobState
from service.routes import actions

_GLANCE = 0.25  # seconds between looks at the progress, which is in memory
_LOOKS = 8  # glances between looks into the database while progress comes
_TELLING = 0.08  # of a sweep: with less done, the time that is left is a guess


class LiveJob:
    """A panel.  ``on_end`` is awaited once, with the job as it ended.

    ``heading``  whether the job's name stands above; not where the page is about it alone.
    """

    def __init__(
        self,
        visitor: Visitor,
        job_id: str,
        on_end: Callable[[JobLine], Awaitable[None]] | None = None,
        *,
        heading: bool = True,
    ) -> None:
        self._visitor, self._job_id, self._on_end = visitor, job_id, on_end
        self._line: JobLine | None = None
        self._glances = 0
        with (
            ui.element("section").classes("panel live-job").props('aria-label="Job"') as self.panel
        ):
            with ui.element("div").classes("row-of-controls"):
                self._name = ui.link("", f"/jobs/{job_id}").classes("panel-title name")
                self._name.set_visibility(heading)
                self._state = ui.label("").props("role=status").classes("job-state")
                ui.space()
                self._cancel = ui.button("Cancel", on_click=self._end_it)
                self._cancel.props("no-caps outline dense").set_visibility(False)
            self._bar = ui.linear_progress(0.0, show_value=False, size="8px")
            self._bar.props('aria-label="Progress" instant-feedback')
            self._words = ui.label("").classes("quiet number")
            with ui.element("div").classes("best-so-far"):
                self._picture = BestPicture()
                self._measure = MeasureLine()
            self._outcome = ui.element("div").classes("outcome")
        self._timer = ui.timer(_GLANCE, self._look)

    async def _look(self) -> None:
        """Progress as often as it comes; the job itself where there is none, and now and then."""
        progress = self._visitor.services.board.latest(self._job_id)
        self._glances += 1
        if self._line is None or progress is None or self._glances % _LOOKS == 0:
            try:
                await self._show(await run_sync(job_line, self._visitor, self._job_id))
            except NotFoundError:
                self._show_removed()
                return
        if progress is not None and self._line is not None and not self._line.state.ended:
            await self._show(
                replace(
                    self._line,
                    state=JobState.RUNNING,
                    stage=progress_words(progress),
                    fraction=progress.fraction,
                    seconds=progress.seconds,
                )
            )
            self._measure.add(progress)
            self._picture.add(progress)

    async def _show(self, line: JobLine) -> None:
        self._line = line
        self._name.text = line.name
        self._state.text = STATES[line.state]
        self._state.classes(replace=f"job-state {STATE_CLASSES[line.state]}")
        self._cancel.set_visibility(not line.state.ended)
        self._bar.set_visibility(not line.state.ended)
        self._bar.value = round(line.fraction, 3)
        self._bar.props["aria-valuetext"] = percent(line.fraction, 0)
        self._words.text = state_words(line)
        if line.state.ended:
            self._timer.cancel()
            self._measure.end()
            self._picture.end()
            with self._outcome:
                show_outcome(line)
            if self._on_end is not None:
                await self._on_end(line)

    def _show_removed(self) -> None:
        self._timer.cancel()
        self._state.text = "removed"
        for one in (self._cancel, self._bar):
            one.set_visibility(False)

    async def _end_it(self) -> None:
        def cancel() -> None:
            caller = self._visitor.caller(Scope.WRITE)
            actions.cancel(self._visitor.services, caller, self._job_id)

        self._cancel.disable()
        with showing_refusals():
            await run_sync(cancel)


def state_words(line: JobLine) -> str:
    """Where a job is that has not ended; empty for one that has."""
    match line.state:
        case JobState.QUEUED:
            tried = f", after {line.attempt} of {line.attempts} attempts" if line.attempt else ""
            place = f"place {line.place} in the queue" if line.place else "in the queue"
            preparing = f"; {line.stage}, {seconds(line.seconds)}" if line.stage else ""
            return place + tried + preparing
        case JobState.RUNNING:
            done = f"{percent(line.fraction, 0)}, {line.stage}" if line.stage else "starting"
            tried = f", attempt {line.attempt}" if line.attempt > 1 else ""
            return f"{done}, {seconds(line.seconds)}{tried}{_left_words(line)}"
        case _:
            return ""


def _left_words(line: JobLine) -> str:
    """How long a sweep still takes, once enough of it is done to tell: its runs are alike."""
    if line.kind is not JobKind.TRADEOFF or line.fraction < _TELLING:
        return ""
    left = line.seconds * (1.0 - line.fraction) / line.fraction
    return f", about {max(round(left), 1)} s left"
