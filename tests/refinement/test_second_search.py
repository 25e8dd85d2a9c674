"""Searches in less room: only where of use, and better than before."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from simplifier.geometry.room import INTERIOR, SURFACE, Room
from simplifier.geometry.views import image_axes
from simplifier.kernels.soup_views import all_contained
from simplifier.options.stages import RefineOptions
from simplifier.refinement.annealing import RefineViews
from simplifier.refinement.finalists import FineViews, Judge, Outlines
from simplifier.refinement.search import Bargain
from simplifier.refinement.second_search import search_again
from simplifier.selection.measure import silhouettes
from tests.pictures import sphere_projections
from tests.refinement.soups import SIZE
from tests.solids import box

LOW, HIGH = np.array([4.0, 10.0, 4.0]), np.array([20.0, 13.0, 20.0])
WIDEST = 5


def slab(more=0.0):
    """Triangles (12, 3, 3) of a slab that is larger on all sides by so many cells."""
    mesh = box(tuple(HIGH - LOW + 2.0 * more), low=tuple(LOW - more))
    return np.array(mesh.vertices[mesh.faces])


def room():
    """Cells of the slab, and one layer after the other around it."""
    cells = np.stack(np.indices((SIZE,) * 3), axis=-1) + 0.5
    away = np.maximum(np.maximum(LOW - cells, cells - HIGH), 0.0).max(axis=-1)
    layers = np.minimum(np.ceil(away), WIDEST).astype(np.uint8) + np.uint8(INTERIOR)
    shares = np.where(layers == INTERIOR, np.uint8(254), np.uint8(0))
    return Room(
        layers, layers, layers, shares, WIDEST, tuple(map(float, range(WIDEST + 1))), 0.0
    )  # fmt: skip


@pytest.fixture(scope="module")
def seen():
    """The slab as the search sees it, and its judge, who looks from other directions."""
    mesh = slab().reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3)

    def maps(seed):
        directions = np.random.default_rng(seed).normal(size=(24, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        return sphere_projections(image_axes(directions), (LOW + HIGH) / 2.0, 14.0)

    views = RefineViews(maps(1), silhouettes(*mesh, maps(1)))
    pictures = FineViews.of(*mesh, maps(2), Outlines.of(*mesh, maps(2)))
    return views, Judge(pictures, 0.99, 0.02)


def again(found, chosen, seen, where=None, overhang=0.02):
    views, judge = seen
    options = RefineOptions(moves=4000, precision=0.99, overhang=overhang)
    return search_again(found, chosen, where or room(), views, judge, 12, options, 3)


def test_what_sticks_out_is_searched_for_again_in_less_room(seen):
    judge = seen[1]
    swollen = slab(1.2)
    assert judge.recall(swollen) > 0.9 > 0.0 > judge.worth(swollen)
    better, less = again([swollen], swollen, seen)
    assert SURFACE <= less.limit < WIDEST
    assert judge.worth(better) > 0.3
    inside = np.zeros(len(better), dtype=np.bool_)
    all_contained(better, less.voxels, inside)
    assert inside.all()


def test_the_room_of_a_second_search_never_grows(seen, monkeypatch):
    """Of Lyon's buildings, once, triangles lay outside of the room by which their error was
    promised."""
    limits, other_room = set(), Bargain._other_room

    def growing(bargain, overhang, share):
        found = other_room(bargain, 0.0, share)  # as where nothing sticks out
        limits.add(bargain.room.limit)
        return found

    monkeypatch.setattr(Bargain, "_other_room", growing)
    _, less = again([slab(1.2)], slab(1.2), seen, overhang=0.5)
    assert limits == {less.limit}


def test_what_has_no_faults_is_not_searched_for_again(seen):
    assert again([slab(-0.1)], slab(-0.1), seen) is None
    assert again([slab(-0.1), slab(-1.0)], slab(-0.1), seen) is None


def test_nor_is_anything_where_there_is_no_less_room(seen):
    assert again([slab(1.2)], slab(1.2), seen, room().up_to(SURFACE)) is None


def test_a_start_that_was_chosen_for_want_of_better_is_no_end(seen):
    """Of a part that is thin from one side the search found 98 % and one view in which it stuck out
    by 6 %, so that a start of 58 % was chosen, by one seed of five."""
    judge, poor = seen[1], slab(-1.2)
    assert judge.worth(poor) < 0.7
    better, _ = again([slab(1.2)], poor, seen)
    assert judge.worth(better) > judge.worth(poor)


def test_what_is_no_better_is_left(seen, monkeypatch):
    swollen = slab(1.2)
    monkeypatch.setattr("simplifier.refinement.second_search.refine", lambda *any_: [swollen])
    assert again([swollen], slab(-0.6), seen) is None


@pytest.mark.parametrize(
    ("recall", "worth", "searched"),
    [(0.9, 0.77, True), (0.9, 0.79, False), (0.3, 0.22, True), (0.3, 0.24, False),
     (0.05, 0.028, True), (0.05, 0.032, False), (0.0, 0.0, False)],
)  # fmt: skip
def test_of_what_hides_little_fewer_faults_are_worth_another(monkeypatch, recall, worth, searched):
    """An eighth of recall, or a quarter where that is less: of plates with holes a first search
    hides a third, and a second one half."""
    asked = []
    monkeypatch.setattr(
        "simplifier.refinement.second_search.refine", lambda *given: asked.append(given) or []
    )
    judge = SimpleNamespace(
        recall=lambda soup: recall, worth=lambda soup: worth,
        worths=lambda soups: [0.0] * len(soups), best_of=lambda soups: soups[0],
        views=SimpleNamespace(outlines=None),
    )  # fmt: skip
    assert again([slab()], slab(), (None, judge)) is None
    assert bool(asked) == searched
