"""One search: what it keeps as its best, and what a price or another search changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from simplifier.geometry.room import Room
from simplifier.kernels.annealing import TRIES
from simplifier.kernels.coverage import coverage_masks, unpack_masks
from simplifier.kernels.soup_views import (
    FRONT_ROWS,
    FRONT_STEP,
    UNIT,
    all_contained,
    draw_union,
)
from simplifier.refinement import annealing
from simplifier.refinement.annealing import (
    Annealing,
    Prices,
    RefineViews,
    _looks,
    by_looks,
    pull_each,
)
from simplifier.refinement.depths import NO_DEPTHS, Depths
from tests.refinement.soups import ball, crossed_quads, score, views_of

SMALL = ball(4.0)  # the original, smaller than where triangles may be: all that moves out costs


def at_price(triangles, views, price):
    return score(triangles, views, price / UNIT)


def hot(seed, price=1, moves=40):
    """A search that is young enough to be on something worse than its best."""
    search = Annealing(crossed_quads(), Room.of(ball()), views_of(SMALL), Prices(price), seed)
    search.run(moves * TRIES, (0.0, 0.2))
    return search


def current(search):
    return search._triangles.copy()


def test_a_new_price_keeps_the_better_of_the_best_and_where_the_search_is():
    """Judged afresh at that price, whichever it was at the old one."""
    views, better = views_of(SMALL), []
    for seed in range(12):
        for price in (3 * UNIT, 40 * UNIT):
            search = hot(seed)
            best, now = search.best(), current(search)
            worth = at_price(best, views, price), at_price(now, views, price)
            search.reprice(Prices(price))
            assert search.score == max(worth)
            assert at_price(search.best(), views, price) == search.score
            assert np.array_equal(current(search), now)
            better.append(np.sign(worth[1] - worth[0]))
    assert {-1, 1} <= set(better)


def test_a_search_goes_on_at_the_new_price():
    """What it then finds is judged by it: what is hidden wrongly goes."""
    search = hot(1)
    search.reprice(Prices(50 * UNIT))
    before = search.score
    for step in range(5):
        search.run(100 * TRIES, (0.5 + 0.1 * step, 0.6 + 0.1 * step))
        assert search.score == at_price(search.best(), views_of(SMALL), 50 * UNIT) >= before
        before = search.score
    assert search.precision() > hot(1, moves=540).precision()


def test_the_same_price_changes_nothing():
    search = hot(3)
    best, worth = search.best(), search.score
    search.reprice(Prices(1))
    assert np.array_equal(search.best(), best)
    assert search.score == worth == at_price(best, views_of(SMALL), 1)


def taken_plainly(triangles, others, price):
    """As :func:`take_from`, by the score of whole soups in all views."""
    views, soup = views_of(SMALL), triangles.copy()
    worths = np.array([worth_in_a_sixth(soup, one, price) for one in range(len(soup))], float)
    for other in others:
        distances = ((soup - other) ** 2).sum(axis=(1, 2))
        near = int(distances.argmin())
        if distances[near] == 0.0:
            continue
        for place in (near, int(worths.argmin())):
            trial = soup.copy()
            trial[place] = other
            if inside(other) and at_price(trial, views, price) > at_price(soup, views, price):
                soup, worths[place] = trial, np.inf
                break
    return soup


def inside(triangle):
    found = np.empty(1, dtype=np.bool_)
    all_contained(triangle[None], Room.of(ball()).voxels, found)
    return bool(found[0])


def worth_in_a_sixth(soup, index, price):
    views = views_of(SMALL)
    sixth = RefineViews(views.projections[::6].copy(), views.originals[::6].copy())
    return at_price(soup, sixth, price) - at_price(np.delete(soup, index, axis=0), sixth, price)


@pytest.mark.parametrize("seed", range(6))
def test_what_gains_is_taken_from_another_search(seed, monkeypatch):
    """Each triangle in place of the nearest, or of the one that adds least, and no other."""
    whole = np.array([[len(views_of(SMALL).projections), 1]])  # no look at a few views before
    monkeypatch.setattr("simplifier.refinement.annealing._looks", lambda count: whole)
    one, other = hot(seed, 6 * UNIT, moves=15), hot(seed + 20, 6 * UNIT, moves=120)
    before, others = current(one), current(other)
    one.take_from(others)
    assert np.array_equal(current(one), taken_plainly(before, others, 6 * UNIT))
    assert not np.array_equal(current(one), before)


def test_taking_keeps_pictures_best_and_score_together():
    """What a search is after that is what one would be that begins there."""
    one, other = hot(4, 6 * UNIT), hot(5, 6 * UNIT)
    was = at_price(current(one), views_of(SMALL), 6 * UNIT)
    one.take_from(other.current())
    afresh = Annealing(current(one), Room.of(ball()), views_of(SMALL), Prices(6 * UNIT), 0)
    assert one.precision() == afresh.precision()
    assert np.array_equal(one._layers, afresh._layers)
    assert np.array_equal(one._images, afresh._images)
    assert np.array_equal(one._scores, afresh._scores)
    assert one._scores.sum() >= was
    assert one.score == at_price(one.best(), views_of(SMALL), 6 * UNIT) >= one._scores.sum()


def test_nothing_is_taken_that_leaves_the_room_or_is_there():
    search = hot(2)
    before, wide = current(search), crossed_quads(40.0)
    search.take_from(np.concatenate([wide, before, before]))
    assert np.array_equal(current(search), before)


def test_a_measure_is_a_share_of_the_originals_own():
    views = views_of(ball())
    search = Annealing(crossed_quads(), Room.of(ball()), views, Prices(UNIT), 0)
    whole = sum(Annealing._score(search, views.originals, np.zeros(16, np.int64)) for _ in "a")
    assert search.measure == pytest.approx(search.score / whole)
    assert 0.0 < search.measure < 1.0
    poor = Annealing(crossed_quads(9.0), Room.of(ball()), views_of(SMALL), Prices(100 * UNIT), 0)
    assert poor.score < 0 == poor.measure


def test_a_start_is_scored_as_by_a_search_that_begins_with_it():
    allowed = ball()
    views, prices = views_of(allowed), Prices(UNIT, 50)
    for half in (2.0, 4.0, 7.0):
        soup = crossed_quads(half)
        search = Annealing(soup, Room.of(allowed), views, prices, 0)
        assert annealing.score(soup, views, prices) == search.score
        share = search.score / annealing.score_of_original(views, prices)
        assert search.measure == max(share, 0.0)


def test_prices_are_by_view():
    tolls = np.arange(3, dtype=np.int64)
    assert Prices(UNIT, 50, tolls).by_view(3).tolist() == [[50, 0], [50, 1], [50, 2]]


def test_no_result_scores_less_than_the_start():
    """A start that is better than all that was found is the result; and at the price of the end."""
    start, views = crossed_quads(2.0), views_of(SMALL)
    search = Annealing(start, Room.of(ball()), views, Prices(1), 0)
    search.run(40 * TRIES, (0.0, 0.1))
    search._triangles[:], search._best[:] = crossed_quads(6.0), crossed_quads(6.0)
    search._draw()
    search.reprice(Prices(100 * UNIT))
    assert at_price(start, views, 100 * UNIT) > search.score
    assert at_price(search.result(), views, 100 * UNIT) >= at_price(start, views, 100 * UNIT)


def test_a_drawn_part_that_sticks_out_does_not_change_what_is_right():
    """It is the user's will: the search must not hide less to make up for it."""
    views = views_of(ball())
    wide = np.array([[[2.0, 2.0, 8.0], [14.0, 2.0, 8.0], [8.0, 14.0, 8.0]]])
    corners = np.arange(3, dtype=np.int32).reshape(1, 3)
    also = views.originals | coverage_masks(wide[0], corners, views.projections, 64, 64)[:, :, 0]
    wider = RefineViews(views.projections, also, wide)
    search = Annealing(crossed_quads(), Room.of(ball()), wider, Prices(UNIT), 0)
    alone = Annealing(crossed_quads(), Room.of(ball()), views, Prices(UNIT), 0)
    assert search.precision() >= alone.precision()
    assert search.score > alone.score
    search.run(10 * TRIES, (0.0, 0.1))
    assert search.score == search._fresh(search.best())


def test_a_search_keeps_nothing_behind_what_is_drawn():
    views, quads = views_of(ball()), crossed_quads()
    behind = RefineViews(views.projections, views.originals, quads)
    assert len(Annealing(quads, Room.of(ball()), behind, Prices(UNIT), 0).result()) == 0


def test_an_original_that_hides_nothing_has_a_measure_of_nothing():
    views = views_of(ball())
    nothing = RefineViews(views.projections, np.zeros_like(views.originals))
    assert Annealing(crossed_quads(), Room.of(ball()), nothing, Prices(UNIT), 0).measure == 0.0


def test_cells_with_room_are_counted_before_each_column():
    allowed = ball(3.0)
    before = Room.of(allowed).cells_before
    assert before[0] == 0
    assert before[-1] == allowed.sum()
    assert np.array_equal(np.diff(before).reshape(allowed.shape[:2]), allowed.sum(axis=2))


def test_a_fine_is_paid_for_each_pixel_past_the_outline_view_by_view():
    """By so much does the score fall, and no further."""
    views, triangles = views_of(SMALL), crossed_quads(6.0)
    fines = np.arange(16) * 3
    free = Annealing(triangles, Room.of(ball()), views, Prices(UNIT), 0)
    fined = Annealing(triangles, Room.of(ball()), views, Prices(UNIT, fines), 0)
    there = np.bitwise_count(views.originals).sum(axis=1)
    outside = np.rint(free.overhang() * there).astype(int)
    assert (outside > 0).all()
    assert free.score - fined.score == (fines * outside).sum()
    for step in range(3):
        fined.run(100 * TRIES, (0.3 * step, 0.3 * step + 0.3))
    assert fined.overhang().mean() < free.overhang().mean()


def test_in_another_room_triangles_are_drawn_in_or_copied():
    search = Annealing(crossed_quads(6.0), Room.of(ball()), views_of(SMALL), Prices(UNIT), 0)
    narrow = Room.of(ball(6.0))
    search.move_to(narrow)
    inside = np.zeros(6, dtype=np.bool_)
    all_contained(search.current(), narrow.voxels, inside)
    assert inside.all()
    assert search.score == search._fresh(search.current())
    assert np.array_equal(search.best(), search.current())


def test_a_search_goes_on_in_another_room():
    search = Annealing(crossed_quads(2.0), Room.of(ball()), views_of(ball()), Prices(1), 0)
    narrow, inside = Room.of(ball(6.0)), np.zeros(6, dtype=np.bool_)
    search.move_to(narrow)
    before = search.current()
    search.run(400 * TRIES, (0.0, 0.2))
    assert (search.current() != before).any(axis=(1, 2)).all()
    all_contained(search.current(), narrow.voxels, inside)
    assert inside.all()


def test_what_cannot_be_in_another_room_is_a_copy_of_what_can():
    start = np.concatenate([crossed_quads(2.0), crossed_quads(2.0)])
    start[:6, :, 0] += 6.0
    search = Annealing(start, Room.of(ball(11.0)), views_of(SMALL), Prices(UNIT), 0)
    beyond = np.zeros_like(ball())
    beyond[15:21] = ball(11.0)[15:21]
    search.move_to(Room.of(beyond))
    assert np.array_equal(search.current()[:6], start[:6])
    assert np.array_equal(search.current()[6:], start[:6])
    nowhere = np.zeros_like(ball())
    nowhere[0, 0, 0] = True
    search.move_to(Room.of(nowhere))
    assert search.score == search._fresh(search.current())


def test_overhang_is_a_share_of_each_views_own_silhouette():
    views = views_of(SMALL)
    views.originals[3] = 0
    search = Annealing(crossed_quads(6.0), Room.of(ball()), views, Prices(UNIT), 0)
    shown, there = (
        unpack_masks(bits[:, :, None], 64) for bits in (search._union(), views.originals)
    )
    beside = (shown & ~there).sum(axis=(1, 2))
    expected = beside / np.maximum(there.sum(axis=(1, 2)), 1)
    np.testing.assert_allclose(search.overhang(), expected, rtol=1e-12)
    assert search.overhang()[3] == beside[3] > 1


def test_other_fines_at_the_same_price_are_paid():
    search = Annealing(crossed_quads(6.0), Room.of(ball()), views_of(SMALL), Prices(UNIT), 0)
    before = search.score
    search.reprice(Prices(UNIT, 50))
    assert search.score == score(search.best(), views_of(SMALL), 1.0, 50) < before


def test_an_outline_tells_how_much_sticks_out_by_a_unit():
    """The pixels around a silhouette, as long as it is, each as wide as its view shows a unit."""
    views, shares = views_of(ball()), []
    masks = unpack_masks(views.originals[:, :, None], 64)
    for mask, projection in zip(masks, views.projections, strict=True):
        around = ndimage.binary_dilation(mask, np.ones((3, 3))) & ~mask
        shares.append(around.sum() / mask.sum() * np.linalg.norm(projection[0, :3]))
    assert views.outline() == pytest.approx(np.mean(shares))
    some = views.originals.copy()
    some[3] = 0
    others = np.delete(shares, 3)
    assert RefineViews(views.projections, some).outline() == pytest.approx(np.mean(others))
    some[3, 30] = 1 << 30  # a pixel has eight around it
    others = [*others, 8.0 * np.linalg.norm(views.projections[3, 0, :3])]
    assert RefineViews(views.projections, some).outline() == pytest.approx(np.mean(others))
    assert RefineViews(views.projections, np.zeros_like(views.originals)).outline() == 0.0


def one_view(views, view):
    return RefineViews(views.projections[view : view + 1], views.originals[view : view + 1])


def test_of_a_sheet_views_from_above_its_sides_tell_it():
    """On edge a flat mesh is all outline, though nothing sticks out across its plane."""
    views = views_of(ball())
    shares = [one_view(views, view).outline() for view in range(16)]
    normal = np.array([0.0, 0.6, 0.8])
    towards = np.cross(views.projections[:, 0, :3], views.projections[:, 1, :3])
    sines = np.abs(towards @ normal) / np.linalg.norm(towards, axis=1)
    from_above = np.array(shares)[sines > 0.5]
    assert 0 < len(from_above) < 16
    found = views.outline(np.array([*normal, 11.0, 11.9]))
    assert found == pytest.approx(from_above.mean())
    assert found != pytest.approx(views.outline(), rel=1e-6)
    assert views.outline(np.array([*normal, 11.0, 12.0])) == views.outline()


def shown(triangles, views):
    """(16, 64) the silhouettes of a soup."""
    union = np.zeros((16, 64), np.uint64)
    draw_union(triangles, views.projections, NO_DEPTHS.arrays(), union)
    return union


ALL_IN_FRONT = Depths(np.zeros((16, 4)), np.ones((16, FRONT_ROWS, 64), np.float32))
"""Everything is at depth 0, and every limit is 1."""


def test_front_is_a_share_of_each_views_original():
    views = replace(views_of(SMALL), depths=ALL_IN_FRONT)
    search = Annealing(crossed_quads(), Room.of(ball()), views, Prices(1), 0)
    rows = shown(crossed_quads(), views)[:, FRONT_STEP // 2 :: FRONT_STEP]
    pixels = np.bitwise_count(rows).sum(axis=1, dtype=np.int64)
    there = np.bitwise_count(views.originals).sum(axis=1, dtype=np.int64)
    assert pixels.min() > 0
    assert search.front() == pytest.approx(FRONT_STEP * pixels / there)
    empty = replace(views, originals=np.zeros_like(views.originals))
    search = Annealing(crossed_quads(), Room.of(ball()), empty, Prices(1), 0)
    assert search.front() == pytest.approx(FRONT_STEP * pixels)  # as if a pixel were there


def test_what_is_drawn_by_hand_hides_and_stands_in_front_of_nothing():
    views = replace(views_of(SMALL), depths=ALL_IN_FRONT, drawn=crossed_quads())
    standing = views.standing()
    assert standing.shape == (16, 64 + FRONT_ROWS) == (16, views.rows)
    assert np.array_equal(standing[:, :64], shown(crossed_quads(), views))
    assert not standing[:, 64:].any()
    plain = replace(views, depths=NO_DEPTHS)
    assert np.array_equal(plain.standing(), standing[:, :64])


@pytest.mark.parametrize("count", [1, 16, 31, 32, 64, 144, 256, 1000])
def test_looks_are_spread_evenly(count):
    """Each look ends a longer and longer begin of the views, at equal distances; the last all."""
    order, looks = by_looks(np.arange(count)), _looks(count)
    assert sorted(order) == list(range(count))
    for end, stride in looks:
        assert sorted(order[:end]) == list(range(0, count, stride))
    assert looks[-1].tolist() == [count, 1]
    assert len(looks) == 1 or 16 <= looks[0, 0] <= 32


def test_each_look_has_four_times_the_views_of_the_one_before_but_for_the_last():
    assert _looks(31).tolist() == [[31, 1]]
    assert _looks(32).tolist() == [[16, 2], [32, 1]]
    assert _looks(128).tolist() == [[16, 8], [64, 2], [128, 1]]
    assert _looks(256).tolist() == [[16, 16], [64, 4], [256, 1]]


def test_no_corner_leaves_the_slab_of_the_room():
    normal, low, high = np.array([0.0, 0.6, 0.8]), 15.0, 17.5
    room = replace(Room.of(ball()), slab=np.array([*normal, low, high]))
    start, inside = pull_each(crossed_quads(), room)
    assert inside.all()
    search = Annealing(start, room, views_of(ball()), Prices(1), 0)
    search.run(400 * TRIES, (0.0, 0.2))
    found = search.current()
    assert (found != start).any(axis=(1, 2)).all()
    for triangles in (start, found, search.best()):
        along = triangles @ normal
        assert low - 1e-9 < along.min() <= along.max() < high + 1e-9
    assert np.count_nonzero(np.abs(found @ normal - high) < 1e-9) > 0  # some lie on its plane
