"""A time limit under a clock that tests turn by hand."""

from __future__ import annotations

import pytest

from simplifier.progress import Deadline


class HandClock:
    """Shows what it was set to."""

    def __init__(self, now=100.0):
        self.now = now

    def __call__(self):
        return self.now


def test_a_limit_runs_out():
    clock = HandClock()
    deadline = Deadline.after(4.0, clock)
    assert (deadline.limited, deadline.share, deadline.left) == (True, 0.0, 4.0)
    clock.now += 1.0
    assert (deadline.share, deadline.left, deadline.is_up) == (0.25, 3.0, False)
    clock.now += 3.0
    assert (deadline.share, deadline.left, deadline.is_up) == (1.0, 0.0, True)
    clock.now += 50.0
    assert (deadline.share, deadline.left, deadline.is_up) == (1.0, 0.0, True)


def test_no_limit_never_comes():
    clock = HandClock()
    deadline = Deadline.after(None, clock)
    clock.now += 1e9
    assert (deadline.limited, deadline.share, deadline.is_up) == (False, 0.0, False)
    assert not deadline.rest().limited


def test_the_rest_ends_at_the_same_moment():
    clock = HandClock()
    deadline = Deadline.after(4.0, clock)
    clock.now += 3.0
    rest = deadline.rest()
    assert (rest.share, rest.left) == (0.0, 1.0)
    clock.now += 0.5
    assert (rest.share, rest.left) == (0.5, deadline.left)
    clock.now += 0.5
    assert rest.is_up
    assert deadline.is_up


def test_a_rest_of_nothing_is_up():
    clock = HandClock()
    deadline = Deadline.after(1.0, clock)
    clock.now += 2.0
    rest = deadline.rest()
    assert (rest.share, rest.is_up) == (1.0, True)


def test_the_clock_of_the_machine_goes_on():
    deadline = Deadline.after(1000.0)
    first = deadline.share
    assert 0.0 <= first < 0.5
    while deadline.share == first:
        pass
    assert deadline.left == pytest.approx(1000.0, abs=400.0)
