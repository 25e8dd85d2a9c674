"""Two runs, picture beside picture."""

from __future__ import annotations

from collections.abc import Sequence

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.asset.comparison import (
    ComparedRuns,
    NumberChange,
    ViewChange,
    read_comparison,
)
from service.dashboard.asset.details import RunDetail
from service.dashboard.asset.view_panels import ShowView, viewer_panel
from service.dashboard.frame import page_frame, panel
from service.dashboard.jobs.words import KINDS
from service.dashboard.notices import showing_unknown
from service.dashboard.plain_table import PlainTable
from service.dashboard.view_map import Axis
from service.dashboard.visitor import Visitor, current_visitor
from service.dashboard.wording import moment, percent, viewpoint

_ID_DIGITS = 8
_LOOKS = {True: "good", False: "bad", None: ""}


@ui.page("/compare")
async def compare_page(a: str, b: str) -> None:
    """``a`` and ``b`` are jobs, usually the older one first."""
    visitor = current_visitor()
    with showing_unknown():
        compared = await _read(visitor, a, b)
        with page_frame(_title(compared), here="/"), ui.element("div").classes("detail"):
            _show(compared)


async def _read(visitor: Visitor, a: str, b: str) -> ComparedRuns:
    def read() -> ComparedRuns:
        return read_comparison(visitor.services, visitor.caller().tenant, a, b)

    return await run_sync(read)


def _title(compared: ComparedRuns) -> str:
    names = dict.fromkeys(one.job.asset or one.job.name for one in (compared.a, compared.b))
    return f"Two runs of {' and '.join(names)}"


def _show(compared: ComparedRuns) -> None:
    with ui.element("div").classes("halves"):
        first, second = (
            viewer_panel(
                one,
                title=_run(letter, one),
                mode="silhouette",
                group="compared",
                suffix=f"_{letter.lower()}",
            )
            for letter, one in (("A", compared.a), ("B", compared.b))
        )
    with ui.element("div").classes("run-panels"):
        _numbers(compared.numbers)
        _differences(compared.options, compared.files)
        _views(compared.views, compared.a.up, first, second)


def _run(letter: str, detail: RunDetail) -> str:
    """With the begin of the job's id, since two runs may be of the same second."""
    job = detail.job
    return f"{letter}: {moment(job.created)}, {KINDS[job.kind]}, job {job.id[:_ID_DIGITS]}"


def _numbers(numbers: Sequence[NumberChange]) -> None:
    with panel("Numbers"):
        table = PlainTable("Numbers of both runs", ["What", "#A", "#B", "#Change"])
        for number in numbers:
            with table.row():
                table.heading(number.name)
                table.number(number.a)
                table.number(number.b)
                table.number(number.change).classes(_LOOKS[number.better])


def _differences(
    options: Sequence[tuple[str, str, str]], files: Sequence[tuple[str, str, str]]
) -> None:
    with panel("Options and files that differ"):
        if not (options or files):
            ui.label("Both runs have the same options and the same files.")
            return
        table = PlainTable("Options and files that differ", ["What", "A", "B"])
        for name, a, b in (*options, *files):
            with table.row():
                table.heading(name)
                table.text(a)
                table.text(b)


def _views(changes: Sequence[ViewChange], up: Axis, first: ShowView, second: ShowView) -> None:
    with panel("Views that changed most"):
        if not changes:
            ui.label("No view changed, or the runs were measured from different views.")
            return
        table = PlainTable("Recall of views that changed most", ["View", "Seen", "#A", "#B"])
        for change in changes:
            with table.row():
                with table.cell():
                    _button(change, first, second)
                table.text(viewpoint(change.a.direction, up))
                table.number(percent(change.a.recall))
                look = _LOOKS[change.rise > 0.0]
                table.number(percent(change.b.recall)).classes(look)


def _button(change: ViewChange, first: ShowView, second: ShowView) -> None:
    def show() -> None:
        first(change.a)
        second(change.b)

    ui.button(f"View {change.a.index}", on_click=show).props("flat dense no-caps size=sm")
