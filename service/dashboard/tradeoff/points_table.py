"""The points of the picture as a table, fastest first."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from service.dashboard.jobs.tables import link_cell, number_cell, table, text_cell
from service.dashboard.jobs.words import percent, seconds_words
from service.dashboard.tradeoff.rows import Point

_STANDINGS = {
    "front": "on the front",
    "dominated": "another is better",
    "imprecise": "not precise enough",
}
_HEADS = ("Setting", "Budget", "Time", "Recall", "Precision", "Triangles", "Standing")


def show_points(caption: str, points: Sequence[Point], precision: float, *, linked: bool) -> None:
    """``linked``: each is a job of its own."""
    with table(caption, _HEADS, frozenset({1, 2, 3, 4, 5})):
        for one in sorted(points, key=lambda one: (one.budget, one.seconds)):
            with ui.element("tr"):
                if linked:
                    link_cell(one.name, f"/jobs/{one.job_id}")
                else:
                    text_cell(one.name)
                number_cell(f"{one.budget:,}")
                number_cell(seconds_words(one.seconds))
                number_cell(percent(one.recall))
                number_cell(percent(one.precision, 2))
                number_cell(f"{one.triangles:,}")
                text_cell(_standing(one, precision), "good" if one.front else "quiet")


def _standing(point: Point, precision: float) -> str:
    if point.standing:
        return _STANDINGS.get(point.standing, point.standing)
    if point.precision < precision:
        return _STANDINGS["imprecise"]
    return _STANDINGS["front" if point.front else "dominated"]
