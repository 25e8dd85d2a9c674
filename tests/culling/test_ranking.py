"""What occluders are worth: by what they hide alone, of views that were not sampled as well."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.culling.ranking import _cover, _Drawn, around, found_within, rank_occluders
from simplifier.geometry.camera import Camera
from simplifier.hierarchy.packing import pack_tree
from tests.culling.occluded import WALL, exact, looking, street, tree_of
from tests.culling.test_culler import random_tree
from tests.solids import box

ROWS, COLUMNS = 45, 80


@given(st.integers(0, 2**32 - 1))
def test_a_cover_is_what_taking_the_best_of_all_each_time_gives(seed):
    rng = np.random.default_rng(seed)
    drawn = [
        _Drawn(node, int(rng.integers(1, 9)), rng.random(30) < rng.uniform(0.0, 0.5))
        for node in range(8)
    ]
    left, rest, expected = np.ones(30, dtype=bool), list(range(8)), []
    while True:
        gains = [(-(drawn[k].hides & left).sum() / drawn[k].triangles, k) for k in rest]
        best, place = min(gains, default=(0.0, 0))
        if best == 0.0:
            break
        rest.remove(place)
        expected.append((place, int((drawn[place].hides & left).sum())))
        left &= ~drawn[place].hides
    assert _cover(drawn, 30) == expected


def test_what_hides_nothing_is_worth_nothing_and_what_is_not_seen_counts_as_usual():
    small = box((0.5, 0.1, 0.5), (8.0, 3.0, 1.0))
    behind = box((9.0, 0.1, 9.0), (-4.0, -30.0, -3.0))
    occluders = {"wall": exact(WALL), "beside": exact(small), "at the back": exact(behind)}
    packed = pack_tree(tree_of(street(), occluders))
    ranking = rank_occluders(packed, [looking()], ROWS, COLUMNS)
    assert (ranking.drawn, ranking.useful) == (2, 1)
    names = [packed.objects[part["object"]] for part in packed.parts]
    worth = dict(zip(names, ranking.tree.worth[packed.parts["node"]].tolist(), strict=True))
    assert worth["wall"] == 1.0
    assert worth["beside"] == 0.0
    assert worth["at the back"] == 1.0


def test_ranked_trees_find_more_with_few_triangles_from_views_between_those_that_ranked():
    packed = pack_tree(random_tree(np.random.default_rng(11), count=200))
    packed = replace(packed, nodes=with_equal_radii(packed.nodes))
    eyes = [np.array([x, y, 0.0]) for x in np.linspace(-30, 30, 12) for y in (-12.0, 12.0)]
    up, ahead = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.2, 0.0])
    views = [
        view for eye in eyes for view in around(Camera.looking(eye, ahead, up, 60.0, 0.1))
    ]  # fmt: skip
    ranked = rank_occluders(packed, views[::2], ROWS, COLUMNS).tree
    before, after = (
        found_within(tree, views[1::2], ROWS, COLUMNS, 120) for tree in (packed, ranked)
    )
    whole = found_within(packed, views[1::2], ROWS, COLUMNS, None)
    assert before < after <= whole
    again = rank_occluders(packed, views[::2], ROWS, COLUMNS).tree
    np.testing.assert_array_equal(ranked.worth, again.worth)


def with_equal_radii(nodes):
    """So that nothing but their worth tells occluders apart."""
    changed = nodes.copy()
    for name in ("far_radius", "near_radius"):
        changed[name] = np.where(changed[name] > 0.0, 1.0, 0.0)
    return changed


def test_a_camera_is_turned_to_its_four_sides():
    camera = looking()
    turned = around(camera)
    forwards = np.array([one.axes[2] for one in turned])
    np.testing.assert_allclose(forwards @ forwards.T, np.eye(4) - np.roll(np.eye(4), 2, axis=0),
                               atol=1e-12)  # fmt: skip
    for one, other in permutations(turned, 2):
        assert not np.allclose(one.axes, other.axes)
    for one in turned:
        np.testing.assert_allclose(np.linalg.det(one.axes), np.linalg.det(camera.axes))
        assert (one.position == camera.position).all()


@pytest.mark.parametrize("conservative", [False, True])
def test_the_buffer_is_that_of_the_tree(conservative, monkeypatch):
    asked = []
    made = DepthBuffer.__init__

    def told(self, rows, columns, coverage="centre"):
        asked.append(coverage)
        made(self, rows, columns, coverage)

    monkeypatch.setattr(DepthBuffer, "__init__", told)
    packed = pack_tree(tree_of(street(), {"wall": exact(WALL)}))
    rank_occluders(replace(packed, conservative=conservative), [looking()], ROWS, COLUMNS)
    assert set(asked) == {"inner" if conservative else "centre"}
