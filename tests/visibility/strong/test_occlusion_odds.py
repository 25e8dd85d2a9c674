"""The odds of strong occlusion: by simulation, and the sums by integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from simplifier.errors import OptionError
from simplifier.visibility.strong.occlusion_odds import (
    blockers_2d,
    blockers_3d,
    most_not_strongly_occluded_2d,
    most_visible_2d,
    not_strongly_occluded_2d,
    not_strongly_occluded_3d,
    strip_between,
    visible_2d,
)

TRIALS = 200_000
CASES = [(1, 1.0), (1, 3.0), (3, 2.0), (6, 1.5), (10, 4.0)]


def bare(starts, ends):
    """Whether intervals (t, k) leave a part of [-1, 1] bare, by a sweep along it."""
    order = np.argsort(starts, axis=1)
    starts, ends = np.take_along_axis(starts, order, 1), np.take_along_axis(ends, order, 1)
    reached, gap = np.full(len(starts), -1.0), np.zeros(len(starts), dtype=np.bool_)
    for start, end in zip(starts.T, ends.T, strict=True):
        gap |= (start > reached) & (reached < 1.0)
        reached = np.maximum(reached, end)
    return gap | (reached < 1.0)


@pytest.mark.parametrize(("count", "ratio"), CASES)
def test_lemma_4_1_holds_for_intervals_by_lot(count, ratio):
    generator = np.random.default_rng(count)
    middles = generator.uniform(-ratio - 1.0, ratio + 1.0, (TRIALS, count))
    starts, ends = middles - ratio, middles + ratio
    assert abs(bare(starts, ends).mean() - visible_2d(count, ratio)) < 0.005
    alone = ~((starts <= -1.0) & (ends >= 1.0)).any(axis=1)
    assert abs(alone.mean() - not_strongly_occluded_2d(count, ratio)) < 0.005


@pytest.mark.parametrize(("count", "ratio"), CASES)
def test_lemma_4_2_holds_for_circles_by_lot(count, ratio):
    generator = np.random.default_rng(count)
    radii = (ratio + 1.0) * np.sqrt(generator.random((TRIALS, count)))
    alone = ~(radii <= ratio - 1.0).any(axis=1)
    assert abs(alone.mean() - not_strongly_occluded_3d(count, ratio)) < 0.005


@pytest.mark.parametrize(("radius", "epsilon", "near"), [(0.5, 0.2, 2.0), (0.9, 0.1, 0.0)])
def test_both_sums_are_the_integrals(radius, epsilon, near):
    ratio = radius / strip_between(radius, epsilon)

    def whole(odds):
        def density(distance):
            blockers = blockers_2d(distance, radius, epsilon)
            return 0.5 * np.pi * distance * odds(blockers, ratio)

        return 0.25 * np.pi * (epsilon + near) ** 2 + quad(density, near, np.inf)[0]

    # As the sum has it, without the bound of 1 that only a part of a blocker exceeds.
    plain = whole(lambda blockers, m: (blockers + 1.0) * (m + 1.0) ** -blockers)
    assert most_visible_2d(radius, epsilon, near) == pytest.approx(plain, rel=1e-6)
    expected = whole(not_strongly_occluded_2d)
    assert most_not_strongly_occluded_2d(radius, epsilon, near) == pytest.approx(expected, rel=1e-6)


def test_known_values():
    assert most_not_strongly_occluded_2d(0.5, 0.2, 2.0) == pytest.approx(231.7, abs=0.05)
    assert most_not_strongly_occluded_2d(0.5, 0.5, 2.0) == float("inf")
    assert blockers_3d(24.0, 1.0, 0.0) == pytest.approx(7.0 * np.pi)
    assert not_strongly_occluded_2d(5, 3.0) == pytest.approx(2.0**-5)  # section 4.2's example
    assert not_strongly_occluded_3d(5, 5.8284) == pytest.approx(2.0**-5, rel=1e-3)
    assert visible_2d(5, 1.0) == pytest.approx(6.0 / 32.0)


def test_what_is_refused():
    for call in (
        lambda: visible_2d(3.0, 0.9),
        lambda: not_strongly_occluded_3d(-1.0, 2.0),
        lambda: most_visible_2d(1.0, 0.1, 1.0),
        lambda: most_visible_2d(0.5, float("nan"), 1.0),
    ):
        with pytest.raises(OptionError):
            call()
