"""The page of one job, whatever becomes of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.asset.details import RunDetail, read_run
from service.dashboard.asset.panels import downloads_panel, run_panels
from service.dashboard.frame import page_frame, panel
from service.dashboard.jobs.ended_jobs import retry_button
from service.dashboard.jobs.job_lines import JobLine, line_of
from service.dashboard.jobs.job_parts import show_failure
from service.dashboard.jobs.live_job import LiveJob
from service.dashboard.jobs.words import KINDS, option_words
from service.dashboard.notices import showing_unknown
from service.dashboard.plain_table import PlainTable
from service.dashboard.visibility.sets_detail import SetsDetail, read_sets
from service.dashboard.visibility.sets_panels import sets_panels
from service.dashboard.visitor import Visitor, current_visitor
from service.dashboard.walk.walk_panel import walk_panel
from service.dashboard.wording import moment
from service.jobs.job import Job, JobKind, JobState


@ui.page("/jobs/{job_id}")
async def job_page(job_id: str) -> None:
    visitor = current_visitor()
    with showing_unknown():
        detail, sets = await run_sync(_read, visitor, job_id)
        with page_frame(detail.job.name, here="/jobs"), ui.element("div").classes("detail"):
            _show(visitor, detail, sets)


def _read(visitor: Visitor, job_id: str) -> tuple[RunDetail, SetsDetail | None]:
    detail = read_run(visitor.services, visitor.caller().tenant, job_id)
    return detail, read_sets(visitor.services.blobs, visitor.services.jobs, detail.job)


def _show(visitor: Visitor, detail: RunDetail, sets: SetsDetail | None) -> None:
    job = detail.job
    _about(detail)
    if not job.state.ended:
        LiveJob(visitor, job.id, _anew, heading=False)
    elif sets is not None:
        sets_panels(sets, detail.files)
    elif job.state is JobState.SUCCEEDED:
        walk_panel(detail)
        run_panels(detail)
    else:
        _show_without_result(visitor, job)
    _options(job.options, visitor.services.tables[job.kind].read({}))
    if job.state is not JobState.SUCCEEDED:
        downloads_panel(detail.files)


def _about(detail: RunDetail) -> None:
    job = detail.job
    with ui.element("div").classes("row-of-controls quiet"):
        ui.label(f"{KINDS[job.kind]}, sent {moment(job.created)}, version {job.version}")
        if job.asset_id:
            ui.link(job.asset or "", f"/assets/{job.asset_id}").classes("name")
        if detail.overrides:
            ui.link("with overrides", detail.overrides).props["download"] = True
        if job.reused:
            ui.link("Stored result of an earlier job", f"/jobs/{job.reused}")
        if job.retry_of:
            ui.link("Retry of an earlier job", f"/jobs/{job.retry_of}")
        if job.kind is JobKind.TRADEOFF:
            if job.asset_id:
                ui.link("Speed against accuracy", f"/tradeoff/{job.asset_id}")
        elif job.state.ended:
            ui.link("Run again with other settings", f"/submit?from={job.id}")


async def _anew(_: JobLine) -> None:
    """Build the page again: what a job makes is shown once it has ended."""
    ui.navigate.reload()


def _show_without_result(visitor: Visitor, job: Job) -> None:
    line = line_of(job)
    with panel("State"):
        if job.failure:
            show_failure(line)
        else:
            ui.label("The job was cancelled. Nothing was kept.")
        retry_button(visitor, line)


def _options(options: Mapping[str, Any], defaults: Mapping[str, Any]) -> None:
    with panel("Options"), ui.element("div").classes("wide-table"):
        table = PlainTable("Options of the job", ("Option", "Value", ""))
    for name, value in options.items():
        with table.row():
            table.heading(name.replace("_", " "))
            table.text(option_words(value))
            table.text("" if value == defaults.get(name) else "chosen", "quiet")
