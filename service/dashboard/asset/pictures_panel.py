"""The report's own picture of the silhouettes, the worst views first."""

from __future__ import annotations

from nicegui import ui

from service.dashboard.frame import panel


def pictures_panel(sheet: str) -> None:
    """``sheet`` is the address of the picture."""
    with panel("Silhouettes of the report"), ui.link(target=sheet, new_tab=True):
        picture = ui.element("img").classes("sheet").props("loading=lazy")
        picture.props["src"] = sheet
        picture.props["alt"] = (
            "Silhouettes of original and occluder over each other from six directions, the worst "
            "first; yellow is hidden rightly, black missed, blue hidden wrongly"
        )
