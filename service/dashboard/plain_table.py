"""Tables as HTML has them: read out by cell, selected and copied as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement


class PlainTable:
    """Rows are added one after the other, and cells to the row that is open.

    ``columns``  headings; those that begin with "#" are of numbers, which are flush right.
    ``caption``  what the table holds, for those who do not see what surrounds it.
    """

    def __init__(self, caption: str, columns: Sequence[str]) -> None:
        with ui.element("table").classes("plain-table"):
            TextElement(tag="caption", text=caption).classes("for-readers")
            with ui.element("thead"), ui.element("tr"):
                for column in columns:
                    heading = TextElement(tag="th", text=column.removeprefix("#"))
                    heading.props("scope=col")
                    if column.startswith("#"):
                        heading.classes("number")
            self._body = ui.element("tbody")

    @contextmanager
    def row(self) -> Iterator[Element]:
        with self._body, ui.element("tr") as row:
            yield row

    def text(self, text: str, look: str = "name") -> TextElement:
        """``look`` is a class of the style sheet."""
        return TextElement(tag="td", text=text).classes(look)

    def link(self, text: str, address: str) -> Element:
        with ui.element("td").classes("name"):
            return ui.link(text, address)

    def heading(self, text: str) -> Element:
        """The cell that says what its row is about."""
        return TextElement(tag="th", text=text).props("scope=row")

    def number(self, text: str) -> TextElement:
        return TextElement(tag="td", text=text).classes("number")

    @contextmanager
    def cell(self) -> Iterator[Element]:
        with ui.element("td") as cell:
            yield cell
