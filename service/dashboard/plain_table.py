"""Tables as HTML has them: read out by cell, selected and copied as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

from service.dashboard.names import name_link

_Cell = TypeVar("_Cell", bound=Element)


class PlainTable:
    """Rows are added one after the other, and cells to the row that is open.

    ``columns``  headings; those that begin with "#" are of numbers, which are flush right.
    ``caption``  what the table holds, for those who do not see what surrounds it.
    ``seldom``   headings of columns that tablets have no room for.
    """

    def __init__(self, caption: str, columns: Sequence[str], seldom: Sequence[str] = ()) -> None:
        self._columns = [column.removeprefix("#") for column in columns]
        self._seldom = frozenset(seldom)
        self._place = 0
        # Roles are said, since style sheets that make cards of rows take them away.
        with ui.element("table").classes("plain-table").props("role=table"):
            TextElement(tag="caption", text=caption).classes("for-readers")
            with (
                ui.element("thead").props("role=rowgroup"),
                ui.element("tr").props("role=row"),
            ):
                for column in columns:
                    heading = TextElement(tag="th", text=column.removeprefix("#"))
                    heading.props("scope=col role=columnheader")
                    if column.startswith("#"):
                        heading.classes("number")
                    if column.removeprefix("#") in self._seldom:
                        heading.classes("seldom")
            self._body = ui.element("tbody").props("role=rowgroup")

    @contextmanager
    def row(self) -> Iterator[Element]:
        self._place = 0
        with self._body, ui.element("tr").props("role=row") as row:
            yield row

    def text(self, text: str, look: str = "name") -> TextElement:
        """``look`` is a class of the style sheet."""
        return self._labelled(TextElement(tag="td", text=text)).classes(look)

    def link(self, text: str, address: str) -> Element:
        with self._labelled(ui.element("td")).classes("name"):
            return name_link(text, address)

    def heading(self, text: str) -> Element:
        """The cell that says what its row is about."""
        heading = self._labelled(TextElement(tag="th", text=text))
        return heading.props("scope=row role=rowheader")

    def number(self, text: str) -> TextElement:
        return self._labelled(TextElement(tag="td", text=text)).classes("number")

    @contextmanager
    def cell(self) -> Iterator[Element]:
        with self._labelled(ui.element("td")) as cell:
            yield cell

    def _labelled(self, cell: _Cell) -> _Cell:
        """The next cell of the row, which knows its column's heading."""
        cell.props["role"] = "cell"
        if self._place < len(self._columns):
            cell.props["data-label"] = self._columns[self._place]
            if self._columns[self._place] in self._seldom:
                cell.classes("seldom")
        self._place += 1
        return cell
