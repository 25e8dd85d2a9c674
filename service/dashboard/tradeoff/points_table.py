"""The points of the picture as a table, fastest first."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from service.dashboard.plain_table import PlainTable
from service.dashboard.tradeoff.points import Point
from service.dashboard.wording import percent, seconds, whole

_STANDINGS = {
    "front": "on the front",
    "dominated": "another is better",
    "imprecise": "not precise enough",
}
_COLUMNS = ("Setting", "#Budget", "#Time", "#Recall", "#Precision", "#Triangles", "Standing")


def show_points(caption: str, points: Sequence[Point], precision: float, *, linked: bool) -> None:
    """``linked``: each is a job of its own."""
    with ui.element("div").classes("wide-table"):
        table = PlainTable(caption, _COLUMNS)
    for one in sorted(points, key=lambda one: (one.budget, one.seconds)):
        with table.row():
            if linked:
                table.link(one.name, f"/jobs/{one.job_id}")
            else:
                table.text(one.name)
            table.number(whole(one.budget))
            table.number(seconds(one.seconds))
            table.number(percent(one.recall))
            table.number(percent(one.precision, 2))
            table.number(whole(one.triangles))
            table.text(_standing(one, precision), "good" if one.front else "quiet")


def _standing(point: Point, precision: float) -> str:
    if point.standing:
        return _STANDINGS.get(point.standing, point.standing)
    if point.precision < precision:
        return _STANDINGS["imprecise"]
    return _STANDINGS["front" if point.front else "dominated"]
