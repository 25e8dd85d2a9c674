"""The page of all assets."""

from __future__ import annotations

from nicegui import ui

from service.dashboard.frame import page_frame


@ui.page("/")
def overview_page() -> None:
    with page_frame("Overview", here="/"):
        ui.label("Nothing here yet")
