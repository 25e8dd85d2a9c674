"""Prices that follow what is hidden wrongly and beside, and a room that narrows."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from simplifier.geometry.room import Room
from simplifier.kernels.soup_views import FRONT_ROWS, UNIT
from simplifier.options.stages import RefineOptions
from simplifier.refinement.depths import Depths
from simplifier.refinement.finalists import DEAREST
from simplifier.refinement.search import Bargain
from tests.refinement.soups import ball, views_of

VIEWS = views_of(ball(5.0))


@dataclass
class Found:
    """A search as far as a bargain looks at it."""

    right: float = 1.0
    shown: np.ndarray = field(default_factory=lambda: np.zeros(16))
    before: float = 0.0

    def precision(self):
        return self.right

    def overhang(self):
        return self.shown

    def front(self):
        return np.full(16, self.before)

    def current(self):
        return np.empty((0, 3, 3))


@dataclass
class Judge:
    """Fine pictures that show so much overhang."""

    found: float

    def overhang(self, triangles):
        return np.full(4, self.found)


def room():
    """Of four limits, one cell of each layer."""
    whole = Room.of(ball())
    return Room(whole.layers, whole.least, whole.most, whole.shares, 3, (0.0, 1.0, 2.0, 3.0), 0.0)


def bargain(judge=None, views=VIEWS, pace=1.0, begun=None, widest=None, **options):
    chosen = RefineOptions(**{"overcover": 0.5, "precision": 0.99, **options})
    return Bargain(chosen, views, judge, begun or room(), pace, widest)


def test_a_price_that_buys_no_precision_settles():
    """Where pixels are too coarse for the precision asked for it rose by half each round, until
    nothing was worth its price: a machine lost half of its triangles by some seeds."""
    prices = bargain(overhang=1.0)
    costs = []
    for index in range(1, 20):
        prices.follow(Found(right=0.98), index / 20.0)
        costs.append(prices.prices.measure)
    assert costs[1] > 1.4 * costs[0]
    assert costs[-2] <= costs[-1] < 1.1 * costs[-2]
    assert costs[-1] == UNIT * DEAREST


@pytest.mark.parametrize(("overcover", "most"), [(0.5, DEAREST), (30.0, 30.0)])
def test_the_price_ends_where_the_judge_pays_no_more(overcover, most):
    """It rose to 58 for a machine, which lost a third of what it hid; precision was no better by
    the pictures that judge.  What was asked for from the first remains."""
    prices = bargain(overhang=1.0, overcover=overcover)
    for _ in range(60):
        prices.follow(Found(right=0.5), 0.1)
    assert prices.prices.measure == UNIT * most


def test_the_price_follows_the_precision():
    prices = bargain(overhang=1.0)
    base = prices.prices.measure
    assert base == UNIT // 2
    for _ in range(3):
        before = prices.prices.measure
        prices.follow(Found(0.97), 0.1)
        assert prices.prices.measure > before
    for _ in range(50):
        prices.follow(Found(0.995), 0.1)
    assert prices.prices.measure == base
    for _ in range(100):
        prices.follow(Found(0.0), 0.1)
    assert prices.prices.measure == UNIT * DEAREST


def test_any_overhang_costs_no_fine_where_all_is_allowed():
    assert np.all(bargain(overhang=1.0).prices.fines == 0)


def test_a_fine_is_in_proportion_to_what_share_of_the_silhouette_a_pixel_is():
    fines = bargain().prices.fines
    areas = np.bitwise_count(VIEWS.originals).sum(axis=1)
    assert fines * areas == pytest.approx(np.full(16, (fines * areas).mean()), rel=0.01)


def test_fines_rise_while_fine_pictures_show_too_much_and_fall_after():
    judge = Judge(0.02)
    prices = bargain(judge, overhang=0.005)
    seen = Found(shown=np.full(16, 0.01))
    before = prices.prices.fines.mean()
    prices.follow(seen, 0.1)
    higher = prices.prices.fines.mean()
    assert higher > 1.5 * before
    judge.found = 0.001
    prices.follow(Found(shown=np.full(16, 0.001)), 0.1)
    assert prices.prices.fines.mean() < higher
    assert prices.room.limit == 3


def test_changes_get_smaller_as_the_search_cools():
    rises = []
    for share in (0.0, 0.5, 0.95):
        prices = bargain(Judge(0.02), overhang=0.005)
        before = prices.prices.fines.mean()
        prices.follow(Found(shown=np.full(16, 0.01)), share)
        rises.append(prices.prices.fines.mean() / before)
    assert rises[0] > 1.3 * rises[1] > rises[2] > 1.0


@pytest.mark.parametrize("sign", [1, -1])
def test_after_twice_the_moves_a_round_changes_prices_by_the_square(sign):
    """With 5 % of overhang allowed a draft of five rounds hid 73 in place of 82 %: its fines could
    not fall in time."""
    right, beside = (0.9, 0.02) if sign > 0 else (0.999, 1e-6)
    changes = []
    for pace in (1.0, 2.0):
        prices = bargain(Judge(beside), pace=pace, overhang=0.005)
        for _ in range(0 if sign > 0 else 4):  # so that there is something to fall from
            prices.follow(Found(right=0.9), 0.0)
        before = prices.prices
        prices.follow(Found(right, np.full(16, beside)), 0.0)
        after = prices.prices
        changes.append((after.measure / before.measure, after.fines.mean() / before.fines.mean()))
    (usual, usual_fine), (few, few_fine) = changes
    assert (usual - 1.0) * sign > 0.1
    assert (usual_fine - 1.0) * sign > 0.1
    assert few == pytest.approx(usual**2, rel=0.15)  # a whole number
    assert few_fine == pytest.approx(usual_fine**2, rel=0.1)


@pytest.mark.parametrize(
    ("pace", "overhang", "times"),
    [
        (1.0, 0.005, 1.0),  # as many rounds as usual have time to rise
        (0.5, 0.005, 1.0),
        (1.44, 0.005, 3.0),
        (1.44, 0.01, 1.5),
        (1.44, 0.001, 3.0),  # and no higher, or it would take out what could be moved
        (1.44, 0.05, 1.0),  # fines that began higher could not fall in time
    ],
)
def test_fines_that_have_few_rounds_begin_higher_where_little_may_stick_out(pace, overhang, times):
    """A quarter of the drafts stuck out by more than 0.6 % where 0.5 % was asked for."""
    usual = bargain(overhang=0.005).prices.fines
    begun = bargain(pace=pace, overhang=overhang).prices.fines
    assert begun == pytest.approx(times * usual, rel=0.01)


def test_what_the_search_cannot_see_takes_a_narrower_room_and_no_fine():
    prices = bargain(Judge(0.02), overhang=0.005)
    unseen = Found(shown=np.full(16, 0.0005))
    before, limits = prices.prices.fines, []
    for _ in range(6):
        prices.follow(unseen, 0.2)
        limits.append(prices.room.limit)
    assert limits == [3, 3, 2, 2, 2, 1]  # rounds between, in which the search answers the new room
    assert np.array_equal(prices.prices.fines, before)
    for _ in range(9):
        prices.follow(unseen, 0.2)
    assert prices.room.limit == 1  # what the surface touches always stays
    late = bargain(Judge(0.02), overhang=0.005)
    for _ in range(9):
        late.follow(unseen, 0.9)  # too late to make good what that takes out
    assert late.room.limit == 3


def test_room_comes_back_where_little_overhang_is_left():
    """By `best` a dungeon lost three layers of its room in as many rounds, and then hid 44 % with
    half of the overhang allowed, in place of 66."""
    judge = Judge(0.02)
    prices = bargain(judge, overhang=0.005)
    unseen = Found(shown=np.full(16, 0.0005))
    for _ in range(6):
        prices.follow(unseen, 0.2)
    judge.found, limits = 0.002, []
    for _ in range(4):
        prices.follow(unseen, 0.5)
        limits.append(prices.room.limit)
    assert limits == [2, 3, 3, 3]  # never more than there was
    judge.found = 0.02
    for _ in range(3):
        prices.follow(unseen, 0.6)
    judge.found = 0.002
    prices.follow(unseen, 0.95)  # too late to make use of it
    assert prices.room.limit == 2


@pytest.mark.parametrize(("found", "limits"), [(0.0005, [2, 3, 3]), (0.002, [1, 1, 1])])
def test_a_room_grows_past_its_begin_where_next_to_nothing_sticks_out(found, limits):
    judge, unseen = Judge(found), Found(shown=np.full(16, 0.0005))
    prices = bargain(judge, begun=room().up_to(1), widest=3, overhang=0.005)
    for limit in limits:
        prices.follow(unseen, 0.2)
        assert prices.room.limit == limit
    judge.found = 0.02
    for _ in range(20):
        prices.follow(unseen, 0.2)
    assert prices.room.limit == 1  # what turns out too much is taken back
    judge.found = 0.0
    alone = bargain(judge, begun=room().up_to(1), overhang=0.005)
    alone.follow(unseen, 0.2)
    assert alone.room.limit == 1  # unless there is no more


def test_without_fine_pictures_its_own_views_tell_what_those_would():
    prices = bargain(overhang=0.005)
    before = prices.prices.fines.mean()
    prices.follow(Found(shown=np.full(16, 0.004)), 0.1)
    assert prices.prices.fines.mean() > before


DEPTHS = Depths(np.zeros((16, 4)), np.zeros((16, FRONT_ROWS, 64), np.float32))


def test_tolls_follow_what_stands_in_front_and_end_where_they_would_take_out_all():
    prices = bargain(views=replace(VIEWS, depths=DEPTHS), overhang=1.0, front=0.02)
    first = prices.prices.tolls.mean()
    for _ in range(3):
        before = prices.prices.tolls.mean()
        prices.follow(Found(before=0.04), 0.1)
        assert prices.prices.tolls.mean() > 1.5 * before
    for _ in range(50):
        prices.follow(Found(before=0.04), 0.1)
    assert prices.prices.tolls.mean() == pytest.approx(16.0 * first, rel=0.01)
    for _ in range(50):
        prices.follow(Found(before=0.001), 0.1)
    assert prices.prices.tolls.mean() < first


def test_front_costs_nothing_where_it_may_be_any_or_no_depth_is_known():
    assert np.all(bargain(views=replace(VIEWS, depths=DEPTHS), front=1.0).prices.tolls == 0)
    assert np.all(bargain(front=0.01).prices.tolls == 0)
