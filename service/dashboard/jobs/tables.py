"""Real tables: a caption, heads and rows."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui


def table(caption: str, heads: Sequence[str], numbers: frozenset[int] = frozenset()) -> ui.element:
    """An empty table; the body, for :func:`row`.  ``numbers`` are columns that hold some."""
    with ui.element("div").classes("table-scroll"), ui.element("table").classes("plain-table"):
        with ui.element("caption").classes("for-readers"):
            ui.label(caption)
        with ui.element("thead"), ui.element("tr"):
            for place, head in enumerate(heads):
                with ui.element("th").props("scope=col") as cell:
                    ui.label(head)
                if place in numbers:
                    cell.classes("number")
        return ui.element("tbody")


def text_cell(text: str, classes: str = "name") -> ui.label:
    with ui.element("td").classes(classes):
        return ui.label(text)


def number_cell(text: str) -> ui.label:
    return text_cell(text, "number")


def link_cell(text: str, address: str) -> None:
    with ui.element("td").classes("name"):
        ui.link(text, address)
