"""The choice under a budget: its budget, its optimum, its ends, and its determinism."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from examples.castle import castle
from simplifier.options.stages import SectionOptions
from simplifier.selection.candidates import Candidates
from simplifier.selection.exchange import choose_by_gain
from simplifier.selection.greedy import greedy_cut, trim_by_area
from tests.selection import plain
from tests.selection.scenes import (
    mesh_candidates,
    projections,
    random_candidates,
    random_chains,
)

VIEWS = 48  # as shipped: coarse scores look at a quarter of them
seeds = st.integers(0, 2**32 - 1)


def every_pair(candidates, budget):
    """Polygon and level of all pairs that the budget allows."""
    most = np.minimum(candidates.triangles, budget)
    polygons = np.repeat(np.arange(len(candidates)), most)
    return polygons, np.concatenate([np.arange(1, m + 1) for m in most])


def plain_fill(candidates, budget, alpha=0.0):
    weights = 1.0 / np.maximum(np.arange(budget + 1.0), 1.0)
    return plain.fill(candidates, *every_pair(candidates, budget), budget, alpha, weights)


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(1, 30), st.integers(1, 120), st.sampled_from([0.0, 0.001, 0.05, 1.0]))
def test_the_budget_holds(seed, count, budget, alpha):
    candidates = random_candidates(seed, count, views=12)
    cut = choose_by_gain(candidates, budget, alpha)
    assert cut.dtype == np.int32
    assert cut.shape == (count,)
    assert cut.sum() <= budget
    assert (cut >= 0).all()
    assert (cut <= candidates.triangles).all()


def test_a_large_part_of_the_optimum_on_tiny_scenes():
    # Greedy choice of a submodular measure has 1 - 1/e; ours is not, so the share is found: 0.89
    # or more, and the optimum itself in 96 of 100.
    shares = []
    for seed in range(30):
        candidates = random_candidates(seed, 4, VIEWS, most_corners=7)
        for budget in (1, 3, 6, 10):
            cut = choose_by_gain(candidates, budget, 0.0)
            shares.append(plain.value(candidates, cut) / plain.best_value(candidates, budget))
    assert max(shares) <= 1.0
    assert min(shares) >= 1.0 - 1.0 / np.e
    assert np.mean(shares) >= 0.985
    assert np.mean(np.array(shares) == 1.0) >= 0.8


@pytest.mark.parametrize(("count", "least", "mean"), [(10, 0.88, 0.985), (30, 0.88, 0.985)])
def test_about_as_good_as_a_plain_greedy_fill(count, least, mean):
    # Coarse scores may mislead the choice; the exchange makes up for most of it: found 0.92 of
    # the plain form at least, and 0.997 in the mean.
    ratios = []
    for seed in range(12):
        candidates = random_candidates(seed, count, VIEWS, most_corners=9)
        for budget in (5, 20):
            cut = choose_by_gain(candidates, budget, 0.0)
            filled = plain_fill(candidates, budget)
            ratios.append(plain.value(candidates, cut) / plain.value(candidates, filled))
    assert min(ratios) >= least
    assert np.mean(ratios) >= mean


def test_budget_of_one_is_nearly_always_the_best_triangle():
    # One scene in 200 lost 30 %, three more some percent: the views of the coarse score lied.
    ratios = []
    for seed in range(40):
        count = 1 + seed % 12
        candidates = random_candidates(seed, count, VIEWS)
        cut = choose_by_gain(candidates, 1, 0.0)
        best = max(plain.score(candidates.draw(polygon, 1)) for polygon in range(count))
        assert cut.sum() == 1
        ratios.append(plain.value(candidates, cut) / best)
    assert min(ratios) >= 1.0 - 1.0 / np.e
    assert np.mean(ratios) >= 0.98


def test_budget_larger_than_all_takes_all_that_adds():
    candidates = random_candidates(7, 12, VIEWS)
    cut = choose_by_gain(candidates, 10_000, 0.0)
    everything = plain.value(candidates, candidates.triangles)
    assert plain.value(candidates, cut) >= 0.995 * everything


def test_more_budget_is_never_much_worse():
    candidates = random_candidates(11, 25, VIEWS)
    values = [
        plain.value(candidates, choose_by_gain(candidates, budget, 0.0))
        for budget in (1, 2, 4, 8, 16, 32, 64)
    ]
    assert all(after >= 0.98 * before for before, after in pairwise(values))
    assert values[-1] > 2 * values[0]


def test_alpha_ends_it_early():
    candidates = random_candidates(13, 30, VIEWS)
    sizes = [int(choose_by_gain(candidates, 200, alpha).sum()) for alpha in (0.0, 0.02, 0.2, 1.0)]
    assert sizes[0] > sizes[1] > sizes[2] >= sizes[3] > 0


def test_no_candidates_and_none_in_sight():
    none = Candidates.from_chains([], projections(VIEWS))
    assert choose_by_gain(none, 64, 0.001).shape == (0,)
    far = projections(VIEWS, centre=(1e4, 1e4, 1e4))
    hidden = Candidates.from_chains(random_chains(1, 3), far)
    assert not choose_by_gain(hidden, 64, 0.001).any()


@pytest.mark.parametrize("choose", [greedy_cut, lambda c, alpha: choose_by_gain(c, 40, alpha)])
def test_nothing_is_added_where_all_is_hidden_already(choose):
    chains, views = random_chains(3, 8), projections(VIEWS)
    alone = Candidates.from_chains(chains, views)
    first = np.zeros(len(alone), dtype=np.int32)
    standing = alone.nothing()
    for polygon, full in enumerate(alone.triangles.tolist()):
        standing |= alone.draw(polygon, full)
    assert choose(alone, 0.001).any()
    beside = Candidates.from_chains(chains, views, standing)
    assert np.array_equal(choose(beside, 0.001), first)


def test_beats_the_published_trim_on_the_castle():
    sections = SectionOptions(directions=32, depths=4)
    candidates = mesh_candidates(castle(), 48, ground=True, sections=sections)
    chosen = choose_by_gain(candidates, 64, 0.001)
    trimmed = trim_by_area(candidates, greedy_cut(candidates, 0.001), 64)
    assert chosen.sum() <= 64
    assert plain.value(candidates, chosen) > 1.2 * plain.value(candidates, trimmed)


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**63 - 2])
def test_the_same_on_any_number_of_threads(monkeypatch, seed):
    candidates = random_candidates(17, 40, VIEWS)
    cuts = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        cuts.append(choose_by_gain(candidates, 30, 0.001, seed=seed).tolist())
    assert cuts[0] == cuts[1] == cuts[2]
    assert cuts[0] == choose_by_gain(candidates, 30, 0.001, seed=seed).tolist()


def test_the_same_in_another_process():
    code = (
        "from tests.selection.scenes import random_candidates\n"
        "from simplifier.selection.exchange import choose_by_gain\n"
        f"print(choose_by_gain(random_candidates(17, 40, {VIEWS}), 30, 0.001).tolist())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    here = choose_by_gain(random_candidates(17, 40, VIEWS), 30, 0.001)
    assert done.stdout.strip() == str(here.tolist())
