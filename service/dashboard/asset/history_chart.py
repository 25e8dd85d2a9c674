"""Recall and precision of an asset's runs over time, with its thresholds and new versions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

from service.dashboard.asset.details import RunLine
from service.dashboard.lazy_chart import LazyChart
from service.jobs.asset import Thresholds

_COLOURS = {"recall": "#3b82c4", "precision": "#c0742a"}
"""Each has 3 : 1 to both backgrounds; the lines differ by their symbols too."""
_SYMBOLS = {"recall": "circle", "precision": "diamond"}
_TEXT = {"color": "currentColor"}
_LINE = "rgba(128,128,128,0.25)"
_STEP = 5  # percent


def history_chart(history: Sequence[RunLine], thresholds: Thresholds) -> None:
    """Draw at least two runs, which come newest first."""
    words = f"Recall and precision of {len(history)} runs over time, as in the table below."
    LazyChart(chart_options(history, thresholds), words).classes("history-chart")


def chart_options(history: Sequence[RunLine], thresholds: Thresholds) -> dict[str, Any]:
    """The chart as ECharts takes it, the oldest run first."""
    runs = list(reversed(history))
    demanded = {"recall": thresholds.min_recall, "precision": thresholds.min_precision}
    return {
        "animation": False,
        "grid": {"left": 48, "right": 24, "top": 34, "bottom": 28},
        "legend": {"top": 0, "left": 0, "textStyle": _TEXT},
        "tooltip": {"trigger": "axis", "renderMode": "richText", "confine": True},
        "xAxis": {
            "type": "category",
            "data": [f"{run.created:%Y-%m-%d %H:%M:%S}" for run in runs],
            "axisLabel": {**_TEXT, "hideOverlap": True},
        },
        "yAxis": {
            "type": "value",
            "min": _lowest(runs, demanded.values()),
            "max": 100,
            "axisLabel": {**_TEXT, "formatter": "{value} %"},
            "splitLine": {"lineStyle": {"color": _LINE}},
        },
        "series": [
            {
                "name": name,
                "type": "line",
                "symbol": _SYMBOLS[name],
                "symbolSize": 7,
                "itemStyle": {"color": _COLOURS[name]},
                "data": [_percent(getattr(run, name)) for run in runs],
                "markLine": {
                    "symbol": "none",
                    "silent": True,
                    "data": [
                        *_threshold_line(name, demanded[name]),
                        *(_version_lines(runs) if name == "recall" else ()),
                    ],
                },
            }
            for name in _COLOURS
        ],
    }


def _lowest(runs: Sequence[RunLine], demanded: Iterable[float | None]) -> int:
    """The percent that the axis begins at: below all runs, and below what is demanded of them."""
    shares = [*demanded, *(getattr(run, name) for run in runs for name in _COLOURS)]
    least = min((share for share in shares if share is not None), default=0.0)
    return min(_STEP * int(100.0 * least / _STEP), 100 - _STEP)


def _percent(share: float | None) -> float | None:
    return None if share is None else round(100.0 * share, 4)


def _threshold_line(name: str, least: float | None) -> list[dict[str, Any]]:
    if least is None:
        return []
    label = {**_TEXT, "formatter": f"least {name}", "position": "insideStartTop"}
    style = {"color": _COLOURS[name], "type": "dashed"}
    return [{"yAxis": _percent(least), "label": label, "lineStyle": style}]


def _version_lines(runs: Sequence[RunLine]) -> list[dict[str, Any]]:
    """One at each run that another version made than the run before."""
    return [
        {
            "xAxis": place,
            "label": {**_TEXT, "formatter": f"version {later.version}", "position": "insideEndTop"},
            "lineStyle": {"color": "rgba(128,128,128,0.8)", "type": "dotted"},
        }
        for place, (earlier, later) in enumerate(pairwise(runs), start=1)
        if earlier.version != later.version
    ]
