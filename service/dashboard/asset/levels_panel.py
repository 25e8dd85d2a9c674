"""The levels of detail: how good each is, and from how far it may be used."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from service.dashboard.asset.details import RunDetail
from service.dashboard.frame import panel
from service.dashboard.plain_table import PlainTable
from service.dashboard.wording import length, percent, whole
from service.schemas.result import Level


def levels_panel(run: RunDetail) -> None:
    with panel("Levels of detail"):
        with ui.element("div").classes("scrolled"):
            _table(run.levels)
        for sentence in run.left_out:
            ui.label(f"Left out {sentence}").classes("quiet")


def _table(levels: Sequence[Level]) -> None:
    table = PlainTable(
        "Levels of detail, finest first",
        ["Level", "#Triangles", "#Recall", "#Precision", "#Error bound", "#Used from", "Files"],
    )
    for level in levels:
        with table.row():
            table.heading(str(level.level))
            table.number(whole(level.triangles))
            table.number(percent(level.recall))
            table.number(percent(level.precision, 2))
            table.number(length(level.error_bound))
            table.number(length(level.switch_distance))
            with table.cell():
                _files(level)


def _files(level: Level) -> None:
    with ui.element("div").classes("links"):
        for suffix, link in sorted(level.files.items()):
            anchor = ui.link(suffix, link)
            anchor.props["download"] = True
            anchor.props["aria-label"] = f"Level {level.level} as .{suffix}"
