"""When an engine has had nothing to do."""

from __future__ import annotations

from service.engines.idleness import Idleness


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


def test_it_counts_from_look_to_look():
    clock = Clock()
    idleness = Idleness(clock)
    assert idleness.seconds is None
    idleness.look()
    assert idleness.seconds is None
    clock.now += 2.0
    idleness.look()
    clock.now += 60.0  # in which nobody looked: the database did not answer
    assert idleness.seconds == 2.0


def test_a_job_that_is_under_way_is_no_idleness_whatever_others_find():
    clock = Clock()
    idleness = Idleness(clock)
    idleness.look()
    idleness.begin()
    for _ in range(3):
        clock.now += 5.0
        idleness.look()
    assert idleness.seconds is None
    idleness.end()
    clock.now += 1.0
    idleness.look()
    assert idleness.seconds is None
    clock.now += 1.0
    idleness.look()
    assert idleness.seconds == 1.0
