"""How recall and precision spread over the views."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, get_args

from nicegui import ui

from service.dashboard.asset.histogram import Bin, binned, quantile
from service.dashboard.frame import panel
from service.dashboard.scale import css
from service.dashboard.views import Measure, View
from service.dashboard.wording import percent

_BAR = (90, 130, 180)
_DIGITS = 2


def histograms_panel(views: Sequence[View]) -> None:
    """Of at least one view."""
    with panel("Spread over the views"):
        for measure in get_args(Measure):
            shares = [view.share(measure) for view in views]
            words = (
                f"{measure.capitalize()}: half of {len(shares)} views have "
                f"{percent(quantile(shares, 0.5), _DIGITS)} or more, one in twenty less than "
                f"{percent(quantile(shares, 0.05), _DIGITS)}, the worst "
                f"{percent(min(shares), _DIGITS)}."
            )
            ui.label(words)
            chart = ui.echart(_options(binned(shares)), renderer="svg").classes("histogram")
            chart.props["role"] = "img"
            chart.props["aria-label"] = f"Histogram. {words}"


def _options(bins: Sequence[Bin]) -> dict[str, Any]:
    return {
        "animation": False,
        "grid": {"left": 36, "right": 8, "top": 8, "bottom": 24},
        "tooltip": {"trigger": "axis", "confine": True},
        "xAxis": {
            "type": "category",
            "data": [f"{100.0 * one.low:g} to {100.0 * one.high:g} %" for one in bins],
            "axisTick": {"show": False},
        },
        "yAxis": {"type": "value", "minInterval": 1, "splitNumber": 3},
        "series": [
            {
                "type": "bar",
                "name": "views",
                "barCategoryGap": "8%",
                "itemStyle": {"color": css(_BAR)},
                "data": [one.count for one in bins],
            }
        ],
    }
