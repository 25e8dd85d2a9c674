"""Points of time against recall."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.tradeoff.points import Point, making_seconds, run_name, with_front
from service.jobs.job import Summary


def point(seconds: float, recall: float, precision: float = 1.0) -> Point:
    return Point("a", 64, seconds, recall, precision, 12, "j")


def test_the_front_is_what_nothing_beats() -> None:
    points = [point(2.0, 0.7), point(1.0, 0.5), point(3.0, 0.6), point(0.5, 0.9, 0.5)]
    assert [one.front for one in with_front(points, 0.99)] == [True, True, False, False]


shares = st.sampled_from([0.0, 0.25, 0.5, 0.75, 1.0])


@given(st.lists(st.builds(point, st.sampled_from([1.0, 2.0, 3.0]), shares, shares), max_size=8))
def test_whatever_is_not_on_the_front_is_beaten_by_it(points: list[Point]) -> None:
    marked = with_front(points, 0.5)
    front = [one for one in marked if one.front]
    for one in marked:
        beaten = any(other.seconds <= one.seconds and other.recall >= one.recall for other in front)
        assert one.front or beaten or one.precision < 0.5
    assert all(one.precision >= 0.5 for one in front)


def test_reading_and_judging_are_no_part_of_the_time() -> None:
    timings = {"load": 5.0, "refine": 1.0, "cut": 0.5, "accuracy": 3.0, "write": 1.0}
    assert making_seconds(Summary(1, 1, 1, 12.0, timings=timings)) == 1.5
    assert making_seconds(Summary(1, 1, 1, 12.0)) == 12.0


def test_a_run_is_named_by_its_settings() -> None:
    options = {"budget": 64, "preset": "best", "resolution": None, "ground": True, "seed": 3}
    assert run_name(options) == "budget 64, preset best, ground"
