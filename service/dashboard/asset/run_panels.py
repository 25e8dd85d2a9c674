"""All that there is to see of one run."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from service.dashboard.asset.details import RunDetail
from service.dashboard.asset.downloads_panel import downloads_panel
from service.dashboard.asset.histograms_panel import histograms_panel
from service.dashboard.asset.levels_panel import levels_panel
from service.dashboard.asset.numbers_panel import numbers_panel
from service.dashboard.asset.pictures_panel import pictures_panel
from service.dashboard.asset.solid_panel import solid_panel, warnings_panel
from service.dashboard.asset.timings_panel import timings_panel
from service.dashboard.asset.viewer_panel import viewer_panel
from service.dashboard.asset.views_panel import views_panel


def run_panels(
    run: RunDetail, holds: bool | None = None, *, beside: Callable[[], None] = lambda: None
) -> None:
    """Of a job that has succeeded; a scene has but numbers, times and files.

    ``beside``  makes what belongs below the numbers.
    """
    summary = run.job.summary
    assert summary is not None, "a job that has succeeded has a summary"
    numbers_panel(summary, holds)
    beside()
    if summary.warnings:
        warnings_panel(summary.warnings)
    if run.views:
        with ui.element("div").classes("beside"):
            show = viewer_panel(run)
            views_panel(run.views, run.up, show)
    if run.levels:
        levels_panel(run)
    with ui.element("div").classes("run-panels"):
        if run.views:
            histograms_panel(run.views)
        timings_panel(summary.timings, summary.seconds)
        if run.solid:
            solid_panel(run.solid, run.deviation, summary.error_bound)
        if run.sheet:
            pictures_panel(run.sheet)
        downloads_panel(run.files)
