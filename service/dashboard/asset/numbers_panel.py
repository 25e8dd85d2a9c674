"""What came out, in a line of numbers."""

from __future__ import annotations

from nicegui import ui

from service.dashboard.wording import percent, seconds, whole
from service.jobs.job import Summary


def numbers_panel(summary: Summary, holds: bool | None) -> None:
    """``holds``  whether it is good enough; None where nothing is demanded."""
    with ui.element("dl").classes("numbers"):
        _number("Recall", percent(summary.recall))
        _number("Precision", percent(summary.precision, 2))
        _number("Worst view", percent(summary.worst_recall))
        _number("Triangles", f"{whole(summary.input_triangles)} to {whole(summary.triangles)}")
        _number("Time", seconds(summary.seconds))
        if holds is not None:
            words, look = ("held", "good") if holds else ("missed", "bad")
            _number("Thresholds", words, look)


def _number(name: str, value: str, look: str = "") -> None:
    with ui.element("div"):
        with ui.element("dt").classes("quiet"):
            ui.label(name)
        with ui.element("dd").classes(f"number {look}"):
            ui.label(value)
