"""Refinement: stays inside, never gets worse, keeps the budget, and has nothing that is no use."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.room import Room
from simplifier.kernels.annealing import TRIES
from simplifier.kernels.soup_views import UNIT, score_unions
from simplifier.kernels.voxelize import is_contained, mark_triangles
from simplifier.options.stages import RefineOptions
from simplifier.progress import Deadline
from simplifier.refinement.annealing import Annealing, Prices
from simplifier.refinement.search import Bargain, _by_time, _exchange, refine
from tests.refinement.soups import SIZE, ball, crossed_quads, score, views_of


def score_of_original(views):
    free, scores = np.zeros((len(views.originals), 2), int), np.zeros(len(views.originals), int)
    return score_unions(views.originals, views.originals, 0, free, scores)


def voxels_touched(triangles):
    """The voxels that the triangles touch, by the voxelizer."""
    touched = np.zeros((SIZE,) * 3, dtype=np.bool_)
    faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    points = np.ascontiguousarray(triangles.reshape(-1, 3))
    mark_triangles(points, faces, np.zeros(3), 1.0, 0, len(faces), touched)
    return touched


def refined(moves, seed=0, budget=6, starts=None, views=None, **options):
    """Refine crossed quads in a ball; no aim for the precision unless it is given."""
    allowed = ball()
    found = refine(
        [crossed_quads()] if starts is None else starts, Room.of(allowed),
        views_of(allowed) if views is None else views, budget,
        RefineOptions(moves=moves, **{"precision": 0.0, "overhang": 1.0, **options}), seed,
    )  # fmt: skip
    return found[0]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_raises_the_score_and_touches_allowed_voxels_only(seed):
    allowed = ball()
    views = views_of(allowed)
    found = refined(3000, seed, views=views)
    assert len(found) <= 6
    assert score(found, views) > 1.3 * score(crossed_quads(), views)
    assert not (voxels_touched(found) & ~allowed).any()


def test_it_never_ends_below_its_start():
    views = views_of(ball())
    for moves in (6, 60, 600):
        found = refined(moves, 7, views=views, searches=1)
        assert score(found, views) >= score(crossed_quads(), views)


def test_a_good_start_is_kept_when_hot_moves_only_spoil_it():
    views = views_of(ball())
    good = refined(30_000, 3, views=views)
    again = refined(6, 4, views=views, starts=[good], searches=1)
    assert score(again, views) >= score(good, views)


@pytest.mark.parametrize("searches", [1, 2])
def test_the_better_of_two_starts_wins(searches):
    """Two searches begin with one each, and one that is alone with what scores most."""
    views = views_of(ball())
    poor = crossed_quads(0.5)
    found = refined(60, 0, views=views, starts=[poor, crossed_quads()], searches=searches)
    assert score(found, views) >= score(crossed_quads(), views) > 2 * score(poor, views)


def test_what_is_left_of_the_budget_is_used():
    views = views_of(ball())
    few = crossed_quads()[:2]
    small = refined(12_000, 1, budget=2, starts=[few], views=views)
    large = refined(12_000, 1, budget=8, starts=[few], views=views)
    assert len(small) <= 2 < len(large) <= 8
    assert score(large, views) > 1.2 * score(small, views)


@pytest.mark.parametrize(
    ("moves", "searches", "seconds", "times"),
    [
        (13_200, 2, None, 1.0),
        (26_400, 2, None, 2.0**0.8),
        (10_000_000, 2, None, 6.0),
        (26_400, 2, 0.01, 1.0),  # by moves that are never made
        (132_000, 1, None, 5.0 / 7.0),  # alone
    ],
)
def test_searches_with_many_moves_a_triangle_begin_hotter(
    monkeypatch, moves, searches, seconds, times
):
    heats = []

    def begun(*given):
        heats.append(given[-1])
        return Annealing(*given)

    begun.result = Annealing.result
    monkeypatch.setattr("simplifier.refinement.search.Annealing", begun)
    allowed = ball()
    deadline = None if seconds is None else Deadline.after(seconds)
    options = RefineOptions(moves=moves, searches=searches, precision=0.0, overhang=1.0)
    refine(
        [crossed_quads()], Room.of(allowed), views_of(allowed), 6, options, 0,
        stop=lambda *now: True, deadline=deadline,
    )  # fmt: skip
    assert heats == [pytest.approx(7e-4 * times)] * searches


def test_a_start_over_the_budget_is_cut_off():
    assert len(refined(600, budget=3)) <= 3
    assert len(refined(0, budget=3)) == 3


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 12), st.integers(1, 2000))
def test_every_triangle_has_a_use_and_no_two_are_alike(seed, budget, moves):
    views = views_of(ball(), 8)
    found = refined(moves, seed, budget, views=views, searches=1)
    assert 1 <= len(found) <= budget
    edges = found[:, 1:] - found[:, :1]
    assert (np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 0.0).all()
    assert len(np.unique(np.sort(found, axis=1).reshape(len(found), -1), axis=0)) == len(found)
    whole = score(found, views)
    for index in range(len(found)):
        assert score(np.delete(found, index, axis=0), views) < whole


def test_no_move_leaves_it_as_it_is():
    assert np.array_equal(refined(0), crossed_quads())


def test_nothing_to_begin_with_gives_nothing():
    outside = crossed_quads() + 3.0 * SIZE
    options = RefineOptions(moves=600)
    assert (
        refine([np.empty((0, 3, 3)), outside], Room.of(ball()), views_of(ball()), 6, options, 0)
        == []
    )


@pytest.mark.parametrize(
    ("moves", "asked", "rounds", "pace"),
    [(6000, 5, 5, 2.0), (6000, 10, 10, 1.0), (24_000, 5, 10, 1.0), (40, 5, 7, 1.0)],
)
def test_rounds_are_those_asked_for_and_more_of_a_long_search(
    moves, asked, rounds, pace, monkeypatch
):
    """Prices of 40 moves changed faster than ever, though no step was longer: nothing was left."""
    shares, paces = [], set()
    follow = Bargain.follow

    def followed(self, search, share):
        shares.append(share)
        paces.add(self._pace)
        follow(self, search, share)

    monkeypatch.setattr(Bargain, "follow", followed)
    refined(moves, budget=4, searches=1, overhang=0.01, rounds=asked)
    assert len(shares) == rounds - 1  # after the last nothing goes on that could follow
    assert np.diff([0.0, *shares]).max() < 1.6 / rounds
    assert paces == {pace}


def test_each_search_gives_a_result_and_the_best_comes_first():
    views = views_of(ball())
    starts = [crossed_quads(), crossed_quads(3.0)[:2], crossed_quads(0.5)]  # of unequal number
    options = RefineOptions(moves=2400, searches=3, precision=0.0, overhang=1.0)
    found = refine(starts, Room.of(ball()), views, 6, options, 0)
    scores = [score(soup, views) for soup in found]
    assert len(found) == 3
    assert scores[0] == max(scores)


def test_searches_take_from_the_next_one_what_gains():
    """Each has one of three squares, and specks in place of the others."""
    views, quads, specks = views_of(ball()), crossed_quads(), crossed_quads(0.5)
    squares = [quads[2 * one : 2 * one + 2] for one in range(3)]
    searches = [
        Annealing(np.concatenate([square, specks[2:]]), Room.of(ball()), views, Prices(UNIT), seed)
        for seed, square in enumerate(squares)
    ]
    before = [search.score for search in searches]
    _exchange(searches)
    for one, search in enumerate(searches):
        has = [all((search.current() == corners).all(axis=(1, 2)).any() for corners in square)
               for square in squares]  # fmt: skip
        assert has == [other in (one, (one + 1) % 3) for other in range(3)]
        assert search.score > before[one]


@pytest.mark.parametrize(("searches", "taken"), [(1, 0), (2, 2 * 16), (3, 3 * 16)])
def test_searches_take_until_the_last_seventh(searches, taken, monkeypatch):
    """What each has found by itself after that is left to the judge."""
    given = []
    monkeypatch.setattr(Annealing, "take_from", lambda self, others: given.append(others))
    options = RefineOptions(moves=20 * TRIES, searches=searches, overhang=0.01, rounds=20)
    refine([crossed_quads()], Room.of(ball()), views_of(ball()), 6, options, 0)
    assert len(given) == taken


def test_same_on_any_number_of_threads(monkeypatch):
    views = views_of(ball())
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(refined(4800, 3, views=views, searches=3, precision=0.999).tobytes())
    assert len(set(results)) == 1


def precision(found, views):
    return Annealing(found, Room.of(ball()), views, Prices(UNIT), 0).precision()


def test_a_dearer_overcover_hides_less_wrongly():
    views = views_of(ball(4.0))  # the original is smaller than what is allowed
    cheap = precision(refined(12_000, 1, views=views, overcover=0.05), views)
    dear = precision(refined(12_000, 1, views=views, overcover=5.0), views)
    assert cheap < 0.98
    assert dear > 0.995


def test_an_aim_for_the_precision_is_met():
    views = views_of(ball(4.0))
    free = refined(24_000, views=views, overcover=0.03)
    held = refined(24_000, views=views, overcover=0.03, precision=0.99)
    assert precision(free, views) < 0.97
    assert precision(held, views) > 0.985


def test_it_can_be_stopped_and_tells_how_far_it_is():
    views = views_of(ball())
    whole = score_of_original(views)
    shares, scores = [], []

    def stop(share, measure, best):
        shares.append(share)
        scores.append(measure)
        assert score(best(), views) == pytest.approx(measure * whole)
        best()[:] = 0.0  # a copy, to be changed at will
        return len(shares) == 3

    options = RefineOptions(moves=24_000, precision=0.0, overhang=1.0)
    found = refine([crossed_quads()], Room.of(ball()), views, 6, options, 0, stop)[0]
    assert len(shares) == 3
    assert shares == sorted(shares)
    assert shares[-1] < 0.5
    assert scores == sorted(scores)
    assert scores[-1] == pytest.approx(score(found, views) / whole)


class StepClock:
    """Goes on by a step whenever it is looked at, so that a slice never seems too short."""

    def __init__(self, step):
        self.now, self._step = 0.0, step

    def __call__(self):
        self.now += self._step
        return self.now


def test_a_deadline_takes_the_place_of_the_moves():
    views = views_of(ball())
    clock, shares = StepClock(0.006), []

    def stop(share, measure, best):
        shares.append(share)
        return False

    deadline = Deadline.after(1.0, clock)
    for moves in (6, 100_000_000):
        options = RefineOptions(moves=moves, searches=1, precision=0.0, overhang=1.0)
        found = refine([crossed_quads()], Room.of(ball()), views, 6, options, 0, stop, deadline)[0]
        assert 1.0 <= clock.now < 1.04
        assert shares == sorted(shares)
        assert len(shares) > 30
        assert shares[-1] > 0.99
        assert score(found, views) > 1.1 * score(crossed_quads(), views)
        clock.now, shares = 0.0, []


def test_a_deadline_that_is_up_leaves_it_as_it_is():
    options = RefineOptions(moves=600)
    same = refine(
        [crossed_quads()],
        Room.of(ball()),
        views_of(ball()),
        6,
        options,
        0,
        deadline=Deadline.after(0.0),
    )
    assert np.array_equal(same[0], crossed_quads())


@pytest.mark.parametrize("cost", [1e-6, 3e-4, 2e-2])
def test_slices_fit_what_a_move_costs(cost):
    clock = StepClock(0.0)
    made = []
    for moves, (first, last) in _by_time(Deadline.after(2.0, clock)):
        assert moves % TRIES == 0
        assert 0.0 <= first < last <= 1.0
        clock.now += moves * cost
        made.append(moves)
    aim = 0.02
    assert max(made) * cost <= 2.0 * max(aim, TRIES * cost)
    assert made[-1] * cost >= min(0.5 * aim, TRIES * cost)
    assert clock.now <= 2.0 + max(aim, TRIES * cost)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.3, 12.0))
def test_containment_is_that_of_the_voxelizer(seed, size):
    rng = np.random.default_rng(seed)
    voxels = rng.random((SIZE,) * 3) < 0.9
    triangle = rng.uniform(size, SIZE - size, 3) + rng.uniform(-size, size, (3, 3))
    corners = [tuple(corner) for corner in triangle.tolist()]
    touched = voxels_touched(triangle[None])
    strays = (triangle.min() <= 0.0) or (triangle.max() >= SIZE)
    expected = not strays and not (touched & ~voxels).any()
    assert is_contained(*corners, Room.of(voxels).voxels) == expected
