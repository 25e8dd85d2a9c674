"""A run that nobody hears and nobody ends has nobody to tell."""

from __future__ import annotations

import threading

import pytest

from simplifier.progress import Deadline, Stopwatch, silent


def test_nobody_is_told_of_a_run_alone():
    assert Stopwatch().steps("cut") is silent


@pytest.mark.parametrize(
    "watch",
    [
        Stopwatch(lambda progress: None),
        Stopwatch(cancel=threading.Event()),
        Stopwatch().until(Deadline.after(60.0)),
    ],
    ids=["heard", "cancelled", "limited"],
)
def test_others_are_told(watch):
    assert not watch.is_alone
    assert watch.steps("cut") is not silent
