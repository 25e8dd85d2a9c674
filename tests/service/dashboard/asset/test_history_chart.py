"""What the chart of an asset's history is told to draw."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from service.dashboard.asset.details import RunLine
from service.dashboard.asset.history_chart import chart_options
from service.jobs.asset import Thresholds
from service.jobs.job import JobKind

BEGIN = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
FIRST = RunLine(
    "a", JobKind.OCCLUDER, BEGIN, "1.0", 0.999, 0.8, 0.5, 0.004, "good", 64, 2.0, True, "defaults"
)


def lines(options, name):
    (series,) = (one for one in options["series"] if one["name"] == name)
    return series["data"], series["markLine"]["data"]


def test_runs_are_points_in_the_order_of_time_with_thresholds_and_new_versions():
    second = replace(FIRST, job_id="b", created=BEGIN + timedelta(1), recall=0.7, precision=None)
    third = replace(second, job_id="c", created=BEGIN + timedelta(2), version="1.1", recall=0.75)
    options = chart_options((third, second, FIRST), Thresholds(min_recall=0.6))
    assert options["xAxis"]["data"][0] == "2026-01-02 03:04:05"
    recall, marks = lines(options, "recall")
    assert recall == [80.0, 70.0, 75.0]
    assert [one.get("yAxis") for one in marks] == [60.0, None]
    assert [(one["xAxis"], one["label"]["formatter"]) for one in marks[1:]] == [(2, "version 1.1")]
    assert lines(options, "precision") == ([99.9, None, None], [])


@pytest.mark.parametrize(
    ("recalls", "least", "begin"),
    [
        ([0.8, 0.9], 0.5, 50),
        ([0.8, 0.42], 0.5, 40),
        ([0.8, 0.9], None, 80),
        ([None, None], None, 95),
        ([1.0, 1.0], 1.0, 95),
    ],
)
def test_the_axis_begins_below_all_runs_and_below_what_is_demanded(recalls, least, begin):
    """A threshold below all runs was not in the picture."""
    runs = [replace(FIRST, precision=1.0, recall=recall) for recall in recalls]
    axis = chart_options(runs, Thresholds(min_recall=least))["yAxis"]
    assert (axis["min"], axis["max"]) == (begin, 100)


def test_without_any_figure_the_axis_begins_at_zero():
    runs = [replace(FIRST, precision=None, recall=None)] * 2
    assert chart_options(runs, Thresholds())["yAxis"]["min"] == 0
