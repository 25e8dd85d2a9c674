"""A job without a result: how far it is, or why it has none."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.frame import panel
from service.dashboard.session import Visitor
from service.dashboard.wording import percent
from service.jobs.job import Failure, Job, JobState

_GLANCE = 1.0  # seconds
_STATES = {
    JobState.QUEUED: "It waits for its turn.",
    JobState.RUNNING: "It runs.",
    JobState.CANCELLED: "It was cancelled.",
}


def state_panel(visitor: Visitor, job: Job) -> None:
    """Loads the page anew when the job ends."""
    with panel("State"):
        if job.failure:
            _failure(job.failure)
            return
        words = ui.label(_STATES[job.state]).props("aria-live=polite")
        if not job.state.ended:
            _follow(visitor, job, words)


def _failure(failure: Failure) -> None:
    ui.label(_sentence(f"It failed: {failure.detail}")).classes("fault name")
    if failure.remedy:
        ui.label(_sentence(f"What to do: {failure.remedy}")).classes("name")
    ui.label(failure.kind).classes("quiet")


def _follow(visitor: Visitor, job: Job, words: ui.label) -> None:
    bar = ui.linear_progress(0.0, show_value=False).props('aria-label="Progress"')

    def read() -> Job:
        return visitor.services.jobs.job(visitor.caller().tenant, job.id)

    async def look() -> None:
        now = await run_sync(read)
        if now.state.ended:
            ui.navigate.reload()
            return
        progress = visitor.services.board.latest(job.id)
        if progress is None:
            words.set_text(_STATES[now.state])
            return
        bar.set_value(progress.fraction)
        so_far = f", {percent(progress.measure)} of the measure" if progress.measure else ""
        words.set_text(f"{progress.stage}, {percent(progress.fraction, 0)}{so_far}")

    ui.timer(_GLANCE, look)


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."
