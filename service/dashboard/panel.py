"""A part of a page under a heading."""

from __future__ import annotations

from nicegui import ui


def panel(title: str) -> ui.element:
    """To be entered by ``with``."""
    with ui.element("section").classes("panel") as section:
        ui.label(title).classes("panel-title").props("role=heading aria-level=2")
    return section
