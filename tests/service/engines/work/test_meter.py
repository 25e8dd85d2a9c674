"""The fraction of a job that is done."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from service.engines.work.meter import JUDGING, MAKING, Meter
from service.jobs.progress import Snapshot
from simplifier import STAGES, Progress

progress = st.builds(
    lambda stage, share, level, more: Progress(stage, share, 0.0, None, level, level + more),
    st.sampled_from(STAGES), st.floats(0.0, 1.0), st.integers(0, 5), st.integers(1, 5),
)  # fmt: skip


@given(st.lists(progress), st.lists(progress))
def test_a_fraction_never_falls_and_keeps_within_its_part(first, second):
    told = []
    meter = Meter(told.append)
    meter.at("load", 0.1)
    for one in first:
        meter.part(0.1, 0.6, MAKING)(one)
    assert all(0.1 <= one.fraction <= 0.6 + 1e-9 for one in told)
    for one in second:
        meter.part(0.6, 1.0, JUDGING)(one)
    fractions = [one.fraction for one in told]
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1.0


def test_levels_share_a_part_and_the_last_one_ends_it():
    told = []
    making = Meter(told.append).part(0.0, 1.0, MAKING)
    for level in range(3):
        for stage in MAKING:
            making(Progress(stage, 0.0, 0.0, None, level, 3))
            making(Progress(stage, 1.0, 0.0, 0.5, level, 3))
    ends = [one.fraction for one in told if one.stage == "accuracy"][1::2]
    assert 0.3 < ends[0] < ends[1] < ends[2]
    assert abs(ends[2] - 1.0) < 1e-9
    assert (told[-1].measure, told[-1].level, told[-1].levels) == (0.5, 2, 3)


def test_a_picture_is_told_with_the_progress_that_it_was_drawn_at():
    told = []
    drawn = iter([Snapshot(1, b"a"), None, Snapshot(2, b"b")])
    making = Meter(told.append).part(0.0, 1.0, MAKING, lambda progress: next(drawn))
    for share in (0.1, 0.2, 0.3):
        making(Progress("refine", share, 0.0, share))
    assert [one.picture for one in told] == [Snapshot(1, b"a"), None, Snapshot(2, b"b")]
    assert [one.measure for one in told] == [0.1, 0.2, 0.3]


def test_shares_of_stages_make_a_whole():
    for shares in (MAKING, JUDGING):
        assert abs(sum(shares.values()) - 1.0) < 1e-9
        assert set(shares) <= set(STAGES)
