"""What a time limit leaves room for."""

from __future__ import annotations

from dataclasses import replace

import pytest

from simplifier.geometry.views import random_directions
from simplifier.options.stages import make_options
from simplifier.progress import Deadline, Stopwatch
from simplifier.slicing.flats import NO_DIRECTIONS
from simplifier.steps.solid import solidify
from simplifier.steps.time_limit import (
    QUICK,
    StartCost,
    affordable_views,
    fewer_directions,
    leaves_time_for,
    quick,
    start_in_time,
)
from tests.solids import box


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


def test_without_a_limit_the_start_is_made_once_as_it_was_asked_for():
    options, seen = make_options(1.0, preset="best"), []
    limit = Deadline.after(None)
    start_in_time(lambda *told: seen.append(told), None, NO_DIRECTIONS, options, "watch", limit)
    assert seen == [(options, "watch")]


def test_a_fuller_start_that_turns_out_slower_is_dropped_for_the_quick_one():
    options = make_options(1.0, preset="best", resolution=8)
    solid = solidify(box(), options.solid, Stopwatch())
    now = [0.0]
    deadline = Deadline.after(10.0, lambda: now[0])
    watch = Stopwatch()
    watch.timings.update(sections=1e-6, loops=1e-6, chains=1e-6, cut=1e-6)
    seen = []

    def start(chosen, watch):
        seen.append(chosen.sections.directions)
        if len(seen) > 1:
            now[0] = 5.1  # half of what was left is spent
            watch.steps("cut")(0.5)
        return len(seen)

    assert start_in_time(start, solid, NO_DIRECTIONS, options, watch, deadline) == 1
    assert seen == [QUICK.directions, options.sections.directions]
    now[0] = 0.0
    seen.clear()
    quickly = start_in_time(lambda *told: len(seen), solid, NO_DIRECTIONS, options, watch, deadline)
    assert quickly == 0


def test_a_start_is_judged_by_what_it_took_itself_and_by_all_directions():
    """Those of flat parts are most of a quick start's and few of a full one's."""
    options = make_options(1.0, preset="best", resolution=8)
    solid, flats = solidify(box(), options.solid, Stopwatch()), random_directions(8, seed=1)
    watch, seen = Stopwatch(), []
    watch.timings.update(sections=1e6)

    def start(chosen, watch):
        seen.append(chosen.sections.directions)
        for stage, seconds in (("sections", 0.1), ("loops", 0.0), ("chains", 0.0), ("cut", 0.0)):
            watch.timings[stage] = watch.timings.get(stage, 0.0) + seconds

    for parts, expected in ((flats, 128), (NO_DIRECTIONS, 64)):
        seen.clear()
        start_in_time(start, solid, parts, options, watch, Deadline.after(6.0, lambda: 0.0))
        assert seen == [QUICK.directions, expected]
