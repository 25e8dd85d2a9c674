"""Names of assets and files on pages: broken where they have parts, and nowhere else if it can be.

``props/medieval/castle_gate`` breaks after slashes, underscores, hyphens and dots.
"""

from __future__ import annotations

import re

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

_PARTS = re.compile(r"[^/_.\- ]*[/_.\- ]*")


def parts_of(name: str) -> list[str]:
    """The name in pieces, each but the last ending with what parts it from the next."""
    return [part for part in _PARTS.findall(name) if part]


def show_name(name: str) -> None:
    """Within the open element: text that may be broken between its parts."""
    for number, part in enumerate(parts_of(name)):
        if number:
            ui.element("wbr")
        TextElement(tag="span", text=part)


def name_link(name: str, address: str) -> Element:
    """A link that is called by the name."""
    with ui.link(target=address).classes("name") as link:
        show_name(name)
    return link
