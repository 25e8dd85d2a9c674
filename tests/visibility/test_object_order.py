"""The order of objects: each once, and one in which sets make few runs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplifier.visibility.object_order as object_order
from simplifier.visibility.object_order import few_runs, z_curve


def runs(sets, order):
    """Where runs begin and end, in all sets."""
    return sum(int(np.count_nonzero(np.diff(row[order].astype(int)))) for row in sets)


@given(st.integers(0, 90), st.integers(0, 20), st.integers(0, 2**32 - 1))
def test_every_object_is_there_once(objects, cells, seed):
    random = np.random.default_rng(seed)
    places = random.choice([0.0, 1.0, 2.5, 1e6], (objects, 2))
    sets = list(random.random((cells, objects)) < random.random())
    order = few_runs(sets, places)
    assert order.dtype == np.int32
    assert np.array_equal(np.sort(order), np.arange(objects))
    assert np.array_equal(np.sort(z_curve(places)), np.arange(objects))


def test_what_is_seen_together_stands_together():
    """Houses along a street, odd ones on one side and even ones on the other."""
    places = np.column_stack([np.arange(60.0), np.arange(60) % 2])
    sets = [np.arange(60) % 2 == side for side in (0, 1)]
    assert runs(sets, z_curve(places)) > 20
    assert runs(sets, few_runs(sets, places)) == 2


def test_the_way_goes_on_when_all_nearby_are_taken(monkeypatch):
    monkeypatch.setattr(object_order, "_NEAR", 2)
    places = np.random.default_rng(0).uniform(0.0, 1.0, (200, 2))
    order = few_runs([places[:, 0] < 0.5], places)
    assert np.array_equal(np.sort(order), np.arange(200))


@pytest.mark.parametrize("most", [1, 3, 100])
def test_some_cells_stand_for_all(monkeypatch, most):
    monkeypatch.setattr(object_order, "_MOST_CELLS", most)
    places = np.column_stack([np.arange(60.0), np.arange(60) % 2])
    sets = [np.arange(60) % 2 == 0] * 10
    assert runs(sets, few_runs(sets, places)) == 10


def test_more_runs_do_not_count_beyond_64_cells():
    """Words of bits are padded with cells that see nothing."""
    random = np.random.default_rng(3)
    places = random.uniform(0.0, 10.0, (300, 2))
    sets = list((random.random((67, 4)) < 0.5)[:, random.integers(0, 4, 300)])
    assert runs(sets, few_runs(sets, places)) < 0.2 * runs(sets, z_curve(places))
