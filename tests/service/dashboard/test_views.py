"""Shares in bins."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.views import histogram, quantile

SHARES = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=300)


@given(SHARES)
def test_every_share_is_in_one_bin(shares: list[float]) -> None:
    bins = histogram(shares)
    assert sum(one.count for one in bins) == len(shares)
    assert bins[0].low - 1e-6 <= min(shares)
    assert max(shares) <= bins[-1].high + 1e-6
    assert all(one.high == following.low for one, following in pairwise(bins))


@given(SHARES)
def test_there_are_never_too_many_bins(shares: list[float]) -> None:
    assert len(histogram(shares)) <= 27


def test_edges_are_round() -> None:
    assert [(one.low, one.count) for one in histogram([0.5, 0.51, 0.999, 1.0])][-1] == (0.95, 2)
    assert histogram([0.5, 1.0])[0].low == 0.5


@given(SHARES, st.floats(0.0, 1.0))
def test_quantiles_are_those_of_numpy(shares: list[float], part: float) -> None:
    assert quantile(shares, part) == pytest.approx(float(np.quantile(shares, part)), abs=1e-12)
