"""Time against recall, drawn and as a table: runs as dots, a front a budget as a line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from service.dashboard.links import Address, keep_in_address
from service.dashboard.plain_table import PlainTable
from service.dashboard.tradeoff.points import Point, Tradeoff
from service.dashboard.wording import overhang, percent, side_by_side, whole

_SYMBOLS = ("rect", "diamond", "roundRect", "pin", "arrow")
_COLOURS = ("#3b82c4", "#c0742a", "#2f8f6b", "#8a63c9", "#b0506a", "#6b7a2f")
"""One a budget, told apart by their symbols too; each has 3 : 1 to both backgrounds."""
_BETWEEN = ";"  # names of series, which have none
_RUN = "#8792a0"
_IMPRECISE = "#c2453c"
_TEXT = {"color": "currentColor"}
_AXIS = {"nameLocation": "middle", "axisLabel": _TEXT, "nameTextStyle": _TEXT,
         "splitLine": {"lineStyle": {"color": "rgba(128,128,128,0.25)"}}}  # fmt: skip

_STANDINGS = {
    "front": "on the front",
    "dominated": "not on the front",
    "imprecise": "not precise enough",
}
_COLUMNS = (
    "Setting",
    "#Budget",
    "#Time to make the occluder",
    "#Recall",
    "#Precision",
    "#Overhang",
    "#Triangles",
    "Standing",
)


class TradeoffChart:
    """The picture; what it shows is in the table as well.

    The address names what somebody has switched off in its legend.
    """

    def __init__(self, known: Tradeoff) -> None:
        # As SVG, whose text takes on the colours of the page.
        self._left_out = Address.of_page().text("without").split(_BETWEEN)
        self._chart = ui.echart(self._options(known), renderer="svg").classes("tradeoff-chart")
        self._chart.on("chart:legendselectchanged", self._hear_legend, ["selected"])
        self._chart.props('role=img aria-label="Time against recall; the table below has the same"')

    def show(self, known: Tradeoff) -> None:
        self._chart.options.clear()
        self._chart.options.update(self._options(known))
        self._chart.update()

    def _options(self, known: Tradeoff) -> dict[str, Any]:
        options = chart_options(known)
        options["legend"]["selected"] = dict.fromkeys(self._left_out, False)
        return options

    def _hear_legend(self, event: GenericEventArguments) -> None:
        told: Mapping[str, bool] = event.args["selected"]
        self._left_out = [str(name) for name, shown in told.items() if not shown]
        keep_in_address(without=_BETWEEN.join(self._left_out) or None)


def chart_options(known: Tradeoff) -> dict[str, Any]:
    """The chart as ECharts takes it.  Names are drawn as text, never as HTML."""
    return {
        "animation": False,
        "grid": {"left": 64, "right": 24, "top": 48, "bottom": 52},
        "legend": {"top": 4, "type": "scroll", "textStyle": _TEXT},
        "tooltip": {"trigger": "item", "renderMode": "richText", "confine": True,
                    ":formatter": "point => point.data.words"},
        "xAxis": {**_AXIS, "type": "log", "name": "time to make the occluder, seconds",
                  "nameGap": 34, "axisLabel": {**_TEXT, "margin": 14}},
        "yAxis": {**_AXIS, "type": "value", "name": "recall, %", "nameGap": 44, **_reach(known)},
        "series": _series(known),
    }  # fmt: skip


def _reach(known: Tradeoff) -> dict[str, float]:
    """The range of recall that is drawn, percent: all that there is, and no more than 100."""
    shares = [10.0 * one.recall for one in (*known.runs, *known.swept)] or [0.0, 10.0]
    return {"min": 10 * max(0, floor(min(shares) - 0.2)),
            "max": 10 * min(10, ceil(max(shares) + 0.2))}  # fmt: skip


def _series(known: Tradeoff) -> list[dict[str, Any]]:
    """The series of points; those that are not precise enough are apart, being on no front."""
    imprecise = [one for one in (*known.runs, *known.swept) if one.precision < known.precision]
    name = f"below {100.0 * known.precision:g} % precision"
    series = [
        _scatter(name, imprecise, _IMPRECISE, "triangle"),
        *_group("runs", known.runs, _RUN, "circle", known.precision),
    ]
    for place, budget in enumerate(sorted({one.budget for one in known.swept})):
        points = [one for one in known.swept if one.budget == budget]
        colour, symbol = _COLOURS[place % len(_COLOURS)], _SYMBOLS[place % len(_SYMBOLS)]
        series += _group(f"sweep, budget {budget:,}", points, colour, symbol, known.precision)
    return [one for one in series if one["data"]]


def _group(
    name: str, points: Sequence[Point], colour: str, symbol: str, precision: float
) -> list[dict[str, Any]]:
    """The points that are precise enough, and their front."""
    precise = [one for one in points if one.precision >= precision]
    front = sorted((one for one in precise if one.front), key=lambda one: one.seconds)
    return [
        _scatter(name, precise, colour, symbol),
        {
            "type": "line", "name": name, "symbol": "none", "silent": True,
            "lineStyle": {"color": colour, "width": 2}, "itemStyle": {"color": colour},
            "data": [{"value": _place(one)} for one in front],
        },
    ]  # fmt: skip


def _scatter(name: str, points: Sequence[Point], colour: str, symbol: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "name": name,
        "symbol": symbol,
        "symbolSize": 10,
        "itemStyle": {"color": colour, "opacity": 1},
        "data": [{"value": _place(one), "words": _words(one)} for one in points],
    }


def _words(point: Point) -> str:
    return (
        f"{point.name}\n{side_by_side(point.seconds)}, recall {percent(point.recall)}, "
        f"precision {percent(point.precision)}, overhang {overhang(point.overhang)}, "
        f"{point.triangles:,} triangles"
    )


def _place(point: Point) -> list[float]:
    return [max(point.seconds, 1e-3), round(100.0 * point.recall, 3)]


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
            table.number(side_by_side(one.seconds))
            table.number(percent(one.recall))
            table.number(percent(one.precision))
            table.number(overhang(one.overhang))
            table.number(whole(one.triangles))
            table.text(_standing(one, precision), "good" if one.front else "quiet")


def _standing(point: Point, precision: float) -> str:
    if point.standing:
        return _STANDINGS.get(point.standing, point.standing)
    if point.precision < precision:
        return _STANDINGS["imprecise"]
    return _STANDINGS["front" if point.front else "dominated"]
