"""The published trim: against re-evaluating all cuts at each step."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.selection.candidates import Candidates
from simplifier.selection.greedy import greedy_cut, trim_by_area
from tests.selection import plain
from tests.selection.scenes import projections, random_candidates, random_chains

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(1, 12), st.integers(0, 60))
def test_equals_re_evaluation_of_all_cuts(seed, count, budget):
    candidates = random_candidates(seed, count, views=2)
    cut = greedy_cut(candidates, 0.0)
    trimmed = trim_by_area(candidates, cut, budget)
    assert trimmed.sum() <= max(budget, 0)
    assert (trimmed <= cut).all()
    assert np.array_equal(trimmed, plain.trimmed(candidates, cut, budget))


def test_a_cut_within_the_budget_stays():
    candidates = random_candidates(4, 5)
    cut = greedy_cut(candidates, 0.0)
    trimmed = trim_by_area(candidates, cut, int(cut.sum()))
    assert np.array_equal(trimmed, cut)
    assert trimmed is not cut


def test_the_budget_is_used_up():
    candidates = random_candidates(6, 9)
    cut = candidates.triangles.copy()
    for budget in range(int(cut.sum()) + 1):
        assert trim_by_area(candidates, cut, budget).sum() == budget


def test_the_argument_is_left_alone():
    candidates = random_candidates(6, 9)
    cut = candidates.triangles.copy()
    trim_by_area(candidates, cut, 3)
    assert np.array_equal(cut, candidates.triangles)


def test_of_equal_losses_the_first_gives_way():
    candidates = Candidates.from_chains([random_chains(3, 1)[0]] * 3, projections(2))
    most = int(candidates.triangles[0])
    assert trim_by_area(candidates, candidates.triangles, 3 * most - 1).tolist() == [
        most - 1, most, most,
    ]  # fmt: skip


def test_no_candidates():
    none = Candidates.from_chains([], projections(2))
    assert trim_by_area(none, np.zeros(0, dtype=np.int32), 5).shape == (0,)
