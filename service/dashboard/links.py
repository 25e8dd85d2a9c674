"""What a page shows, kept in its address, and the button that copies it."""

from __future__ import annotations

import json
from pathlib import Path

from nicegui import ui
from nicegui.element import Element

ADDRESS = str(Path(__file__).with_name("address"))
"""The module that reads and writes the address."""


class CopyButton(Element, component="copy_button.js", esm={"occluder-address": ADDRESS}):
    """Copies a text; the page's own address where none is given."""

    def __init__(self, title: str = "Copy link", text: str | None = None) -> None:
        super().__init__()
        self.props["title"] = title
        if text is not None:
            self.props["text"] = text


def keep_in_address(**values: str | None) -> None:
    """Put values into the query of the page's address, by their names; None takes one out.

    The page function takes them as its parameters, so that a reload, or whoever is sent the link,
    sees the same.
    """
    ui.run_javascript(f"window.keepInAddress({json.dumps(values)})")
