"""The greedy cut: complete by its definition, and its lazy form against the plain one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from examples.castle import castle
from simplifier.io.load import load
from simplifier.options.stages import SectionOptions
from simplifier.selection.candidates import Candidates
from simplifier.selection.greedy import greedy_cut
from tests.selection import plain
from tests.selection.scenes import (
    mesh_candidates,
    projections,
    random_candidates,
    random_chains,
)

ALPHAS = (0.0, 0.001, 0.02, 1.0)
seeds = st.integers(0, 2**32 - 1)


def greedy_by_definition(candidates, alpha):
    """Whole polygons, the largest gain first, the first of equals: pictures drawn one by one."""
    cut = np.zeros(len(candidates), dtype=np.int32)
    full = [candidates.draw(p, int(k)) for p, k in enumerate(candidates.triangles)]
    union = candidates.nothing()
    while True:
        total = plain.value(candidates, cut)
        gains = [
            -1 if cut[p] else plain.score(union | image) - total for p, image in enumerate(full)
        ]
        best = int(np.argmax(gains))
        if gains[best] <= 0 or gains[best] < alpha * total:
            return cut
        cut[best] = candidates.triangles[best]
        union |= full[best]


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(1, 20), st.sampled_from(ALPHAS))
def test_plain_form_follows_the_definition(seed, count, alpha):
    candidates = random_candidates(seed, count)
    expected = greedy_by_definition(candidates, alpha)
    assert np.array_equal(greedy_cut(candidates, alpha, lazy=False), expected)


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(1, 40), st.sampled_from(ALPHAS), st.booleans())
def test_cuts_are_complete_and_whole(seed, count, alpha, lazy):
    candidates = random_candidates(seed, count)
    cut = greedy_cut(candidates, alpha, lazy=lazy)
    assert cut.dtype == np.int32
    assert (np.isin(cut, 0) | (cut == candidates.triangles)).all()
    assert plain.is_complete(candidates, cut, alpha)


def test_lazy_equals_plain_on_small_scenes():
    # The measure is not submodular, so this is found, not proved: 72 of 72.
    for seed in range(24):
        candidates = random_candidates(seed, 5 + seed % 16, views=8)
        for alpha in ALPHAS[:3]:
            lazy = greedy_cut(candidates, alpha)
            assert np.array_equal(lazy, greedy_cut(candidates, alpha, lazy=False))


def test_lazy_nearly_equals_plain_on_larger_scenes():
    # Here a gain may rise behind its old bound: found 99 of 100 the same, the others within 2 %.
    same = []
    for seed in range(12):
        candidates = random_candidates(seed, 60, views=12)
        lazy, full = greedy_cut(candidates, 0.001), greedy_cut(candidates, 0.001, lazy=False)
        same.append(np.array_equal(lazy, full))
        ratio = plain.value(candidates, lazy) / plain.value(candidates, full)
        assert ratio == pytest.approx(1.0, abs=0.03)
    assert np.mean(same) >= 0.9


def check_lazy(candidates):
    """Both complete, and of about the same measure with about as many polygons."""
    lazy, full = greedy_cut(candidates, 0.001), greedy_cut(candidates, 0.001, lazy=False)
    assert plain.is_complete(candidates, lazy, 0.001)
    assert plain.is_complete(candidates, full, 0.001)
    ratio = plain.value(candidates, lazy) / plain.value(candidates, full)
    assert ratio == pytest.approx(1.0, abs=0.01)
    assert abs(np.count_nonzero(lazy) - np.count_nonzero(full)) <= 6


FEW = SectionOptions(directions=32, depths=4)


def test_lazy_is_complete_on_the_castle():
    # Its stop used to trust the old bounds, and left a polygon worth 0.1 % outside.
    check_lazy(mesh_candidates(castle(), 64, ground=True, sections=FEW))


@pytest.mark.parametrize(("name", "ground"), [("bunny_4968.ply", True), ("dragon_871k.ply", False)])
def test_lazy_is_complete_on_assets(asset, name, ground):
    # With all sections of the defaults the measures differed by 0.1 % on both.
    mesh = load(asset(name))
    check_lazy(mesh_candidates(mesh, 64, ground=ground, sections=FEW))


def test_equal_polygons_the_first_wins():
    chain = random_chains(3, 1)[0]
    candidates = Candidates.from_chains([chain] * 20, projections(4))
    for lazy in (True, False):
        cut = greedy_cut(candidates, 0.001, lazy=lazy)
        assert cut.nonzero()[0].tolist() == [0]


def test_no_candidates_and_none_in_sight():
    assert greedy_cut(Candidates.from_chains([], projections(4)), 0.001).shape == (0,)
    far = projections(4, centre=(1e4, 1e4, 1e4))
    hidden = Candidates.from_chains(random_chains(1, 3), far)
    assert not greedy_cut(hidden, 0.0).any()


def test_threads_do_not_change_the_cut(monkeypatch):
    candidates = random_candidates(8, 50)
    cuts = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        cuts.append(greedy_cut(candidates, 0.001).tolist())
    assert cuts[0] == cuts[1] == cuts[2]
