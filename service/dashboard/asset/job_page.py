"""The page of one job, whatever became of it."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.asset.rows import RunDetail, read_run
from service.dashboard.asset.run_panels import run_panels
from service.dashboard.asset.state_panel import state_panel
from service.dashboard.frame import page_frame
from service.dashboard.session import Visitor, current_visitor
from service.dashboard.unknown import unknown_told
from service.jobs.job import JobState


@ui.page("/jobs/{job_id}")
async def job_page(job_id: str) -> None:
    visitor = current_visitor()
    with unknown_told():
        detail = await _read(visitor, job_id)
        with page_frame(detail.job.name, here="/jobs"), ui.element("div").classes("detail"):
            _show(visitor, detail)


async def _read(visitor: Visitor, job_id: str) -> RunDetail:
    def read() -> RunDetail:
        return read_run(visitor.services, visitor.caller().tenant, job_id)

    return await run_sync(read)


def _show(visitor: Visitor, detail: RunDetail) -> None:
    job = detail.job
    with ui.element("div").classes("row-of-controls quiet"):
        ui.label(f"{job.kind} job {job.id}")
        if job.asset_id is not None:
            ui.link(job.asset or "", f"/assets/{job.asset_id}").classes("name")
    if job.state is JobState.SUCCEEDED:
        run_panels(detail)
    else:
        state_panel(visitor, job)
