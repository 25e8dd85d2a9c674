"""What a time limit leaves room for."""

from __future__ import annotations

from dataclasses import replace

import pytest

from simplifier.options.stages import make_options
from simplifier.steps.time_limit import (
    QUICK,
    StartCost,
    affordable_views,
    fewer_directions,
    leaves_time_for,
    quick,
)


def test_a_quick_start_is_less_work_on_the_same_solid():
    options = make_options(1.0, preset="best", slicer="gl", budget=7, resolution=20, ground=True)
    small = quick(options)
    assert small.sections == replace(QUICK, slicer="gl")
    assert small.selection == replace(options.selection, exchanges=0)
    assert (small.solid, small.refine, small.seed) == (options.solid, options.refine, options.seed)


@pytest.mark.parametrize(("preset", "counts"), [("draft", [16, 8]), ("balanced", [32, 16, 8])])
def test_directions_are_halved_down_to_the_quick_start(preset, counts):
    made = fewer_directions(make_options(1.0, preset=preset))
    assert [options.sections.directions for options in made] == counts


def test_more_work_fits_when_it_leaves_most_of_the_time():
    done, more = StartCost(100, 10, 0), StartCost(400, 30, 0)
    cost = 4 * 0.1 + 3 * 0.2
    assert leaves_time_for(done, 0.1, 0.2, more, 4.01 * cost)
    assert not leaves_time_for(done, 0.1, 0.2, more, 3.99 * cost)
    assert not leaves_time_for(done, 0.1, 0.2, replace(more, exchanges=8), 4.01 * cost)
    assert not leaves_time_for(done, 0.1, 0.2, more, 0.0)


@pytest.mark.parametrize(
    ("took", "left", "views"),
    [(0.1, 10.0, 64), (0.1, 1.0, 40), (0.1, 0.5, 16), (0.1, 0.0, 16), (0.0, 1.0, 64)],
)
def test_views_take_a_quarter_of_the_time_or_stay(took, left, views):
    assert affordable_views(64, 16, took, left) == views


def test_no_more_views_than_asked_for():
    assert affordable_views(8, 8, 0.001, 100.0) == 8
