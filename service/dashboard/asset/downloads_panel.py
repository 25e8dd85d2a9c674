"""Every file of a job."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from service.dashboard.frame import panel
from service.dashboard.plain_table import PlainTable
from service.schemas.result import ResultFile

_SHOWN = (".html", ".png", ".json")  # by the browser itself


def downloads_panel(files: Sequence[ResultFile]) -> None:
    with panel("Downloads"), ui.element("div").classes("scrolled"):
        table = PlainTable("Files of the job", ["File", "#Size"])
        for file in files:
            with table.row():
                with table.cell():
                    link = ui.link(file.name, file.link, new_tab=file.name.endswith(_SHOWN))
                    if not file.name.endswith(_SHOWN):
                        link.props["download"] = True
                table.number(size(file.size))


def size(count: int) -> str:
    """Bytes, in the largest unit that they fill."""
    for unit, worth in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if count >= worth:
            return f"{count / worth:.1f} {unit}"
    return f"{count} B"
