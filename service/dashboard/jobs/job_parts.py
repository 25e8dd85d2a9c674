"""Parts of pages that show a job: its name and kind, its figures, or what went wrong."""

from __future__ import annotations

from nicegui import ui

from service.dashboard.jobs.job_lines import JobLine
from service.dashboard.jobs.words import KINDS
from service.dashboard.plain_table import PlainTable
from service.dashboard.wording import VERDICT_CLASSES, overhang, percent, seconds
from service.jobs.job import JobKind, JobState


def show_outcome(line: JobLine) -> None:
    """Show what came of a job that has ended."""
    match line.state:
        case JobState.SUCCEEDED:
            _show_figures(line)
        case JobState.FAILED:
            # Read out at once: somebody waits for it.
            show_failure(line, role="alert")
        case _:
            ui.label("The job was cancelled. Nothing was kept.").classes("quiet")


def show_failure(line: JobLine, role: str = "note") -> None:
    """The reason and the remedy in words."""
    with ui.element("div").classes("fault").props(f"role={role}"):
        ui.label(line.title).classes("fault-title")
        ui.label(line.reason).classes("name")
        if line.remedy:
            ui.label(f"What to do: {line.remedy}").classes("name")


def _show_figures(line: JobLine) -> None:
    with ui.element("dl").classes("figures"):
        for name, value in _figures(line):
            with ui.element("div"):
                _term(name)
                with ui.element("dd").classes("number"):
                    ui.label(value)
    if line.verdict:
        words = f"{line.verdict.capitalize()} for an engine: {line.verdict_reason}."
        ui.label(words).classes(f"name {VERDICT_CLASSES[line.verdict]}")
    with ui.element("div").classes("row-of-controls"):
        if line.asset_id and line.kind is JobKind.TRADEOFF:
            ui.link("See the trade-off", f"/tradeoff/{line.asset_id}")
        elif line.asset_id:
            ui.link("See the asset", f"/assets/{line.asset_id}")
        sets = line.kind is JobKind.VISIBILITY
        ui.link("See the visible sets" if sets else "See the job", f"/jobs/{line.id}")
        if line.kind is not JobKind.TRADEOFF:
            ui.link("Run again with other settings", f"/submit?from={line.id}")


def _term(name: str) -> None:
    with ui.element("dt").classes("quiet"):
        ui.label(name)


def _figures(line: JobLine) -> list[tuple[str, str]]:
    if line.kind is JobKind.VISIBILITY:
        return [("run time", seconds(line.seconds))]
    swept = line.kind is JobKind.TRADEOFF
    return [
        ("triangles", f"{line.triangles:,}" if line.triangles is not None else "-"),
        ("its precision" if swept else "precision", percent(line.precision)),
        ("best recall" if swept else "recall", percent(line.recall)),
        ("its overhang" if swept else "overhang", overhang(line.overhang)),
        ("run time", seconds(line.seconds)),
    ]


def name_cells(table: PlainTable, line: JobLine) -> None:
    """Three cells: the job, its asset, its kind."""
    table.link(line.name, f"/jobs/{line.id}")
    if line.asset_id:
        table.link(line.asset or "", f"/assets/{line.asset_id}")
    else:
        table.text("-", "quiet")
    table.text(KINDS[line.kind])
