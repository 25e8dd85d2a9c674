"""The page of one job."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.frame import page_frame
from service.dashboard.jobs.ended import retry_button
from service.dashboard.jobs.live import LiveJob
from service.dashboard.jobs.rows import JobFacts, JobLine, job_facts
from service.dashboard.jobs.tables import link_cell, number_cell, table, text_cell
from service.dashboard.jobs.words import KINDS, moment_words, sentence, size_words
from service.dashboard.panel import panel
from service.dashboard.session import Visitor, current_visitor
from service.errors import NotFoundError
from service.jobs.job import JobState


@ui.page("/jobs/{job_id}")
async def job_page(job_id: str) -> None:
    visitor = current_visitor()
    try:
        facts = await run_sync(job_facts, visitor, job_id)
    except NotFoundError as error:
        with page_frame("No such job", here="/jobs"):
            ui.label(sentence(error.detail)).classes("name")
            ui.link("See all jobs", "/jobs")
        return
    with page_frame(facts.line.name, here="/jobs"):
        _about(facts)
        LiveJob(visitor, job_id, None if facts.line.state.ended else _anew, heading=False)
        _doing(visitor, facts)
        if facts.summary and facts.summary.warnings:
            _warnings(facts.summary.warnings)
        _options(facts.options, facts.defaults)
        _files(facts)


async def _anew(_: JobLine) -> None:
    """Build the page again: what a job makes is listed once it has ended."""
    ui.navigate.reload()


def _about(facts: JobFacts) -> None:
    line = facts.line
    with ui.element("div").classes("row-of-controls quiet"):
        ui.label(
            f"{KINDS[line.kind]}, sent {moment_words(line.created)} UTC, version {facts.version}"
        )
        if line.asset_id:
            with ui.element("span"):
                ui.label("asset ").classes("inline")
                ui.link(line.asset or "", f"/assets/{line.asset_id}").classes("name")
        if facts.reused:
            ui.link("the stored result of an earlier job", f"/jobs/{facts.reused}")
        if facts.retry_of:
            ui.link("does a job again", f"/jobs/{facts.retry_of}")


def _doing(visitor: Visitor, facts: JobFacts) -> None:
    if facts.line.state in (JobState.FAILED, JobState.CANCELLED):
        with ui.element("div").classes("row-of-controls"):
            retry_button(visitor, facts.line)
            ui.link("Run again with other settings", f"/submit?from={facts.line.id}")


def _warnings(warnings: tuple[str, ...]) -> None:
    with panel("Warnings"), ui.element("ul"):
        for warning in warnings:
            with ui.element("li"):
                ui.label(sentence(warning)).classes("name")


def _options(options: Mapping[str, Any], defaults: Mapping[str, Any]) -> None:
    with panel("Options"), table("Options of the job", ("Option", "Value", "")):
        for name, value in options.items():
            with ui.element("tr"):
                text_cell(name.replace("_", " "))
                text_cell(option_words(value))
                text_cell("" if value == defaults.get(name) else "chosen", "quiet")


def option_words(value: Any) -> str:
    """A value as people write it."""
    match value:
        case None:
            return "-"
        case bool():
            return "yes" if value else "no"
        case list() | tuple():
            return ", ".join(f"{one:g}" for one in value)
        case float():
            return f"{value:g}"
        case int():
            return f"{value:,}" if abs(value) < 10**9 else str(value)
        case _:
            return str(value)


def _files(facts: JobFacts) -> None:
    with panel("Files"), table("Files of the job", ("File", "Size", ""), frozenset({1})):
        for file in facts.files:
            with ui.element("tr"):
                link_cell(file.name, f"/v1/jobs/{facts.line.id}/files/{quote(file.name)}")
                number_cell(size_words(file.blob.size))
                text_cell("as it was sent" if file.is_input else "", "quiet")
