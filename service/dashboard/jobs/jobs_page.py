"""The page of all jobs."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.frame import page_frame
from service.dashboard.jobs.ended_jobs import EndedJobs
from service.dashboard.jobs.job_lines import jobs_now
from service.dashboard.jobs.waiting import WaitingJobs
from service.dashboard.visitor import current_visitor


@ui.page("/jobs")
async def jobs_page(state: str = "all") -> None:
    """``state`` is one that a job ends in, or all."""
    visitor = current_visitor()
    now = await run_sync(jobs_now, visitor)
    with page_frame("Jobs", here="/jobs"):
        WaitingJobs(visitor, now)
        await EndedJobs(visitor, state).load()
