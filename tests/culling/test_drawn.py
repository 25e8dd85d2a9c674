"""What each way of culling draws along a path, and that both together never draw more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.drawn import Drawn, Spread, Way
from simplifier.culling.flythrough import fly
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.culling.visible_sets import VisibleSets
from simplifier.hierarchy.parts import split_large
from tests.culling.occluded import (
    HIDDEN,
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    sets_of,
    street,
    tree_of,
)
from tests.solids import box, sphere
from tests.walkable import scene_of

OUTSIDE = (30.0, -10.0, 3.0)


def flown(scene, sets, *cameras, occluders=None):
    made = {"wall": exact(WALL)} if occluders is None else occluders
    held = None if sets is None else VisibleSets.of(sets_of(scene, *sets), scene, scene)
    return fly(scene, tree_of(scene, made), path_of(*cameras), SMALL, sets=held)


def test_the_four_ways_past_a_wall():
    """Of the four boxes behind the wall the sets have one; the camera has one at its back."""
    scene = street()
    found = flown(scene, [["wall", "beside", "at the back", HIDDEN[0]]]).total
    assert found.drawn == {
        Way.FRUSTUM: Drawn(6, 6 * 12), Way.PVS: Drawn(3, 3 * 12), Way.OCCLUDERS: Drawn(2, 2 * 12),
        Way.BOTH: Drawn(2, 2 * 12),
    }  # fmt: skip
    assert found.outside_cells == 0


def test_without_sets_there_are_two_ways():
    found = flown(street(), None).total
    assert list(found.drawn) == [Way.FRUSTUM, Way.OCCLUDERS]


def test_outside_of_all_cells_the_sets_change_nothing():
    found = flown(street(), [["wall"]], looking(OUTSIDE), looking()).frames
    assert [frame.figures.outside_cells for frame in found] == [1, 0]
    outside, inside = (frame.figures.drawn for frame in found)
    assert outside[Way.PVS] == outside[Way.FRUSTUM]
    assert outside[Way.BOTH] == outside[Way.OCCLUDERS]
    assert inside[Way.PVS].objects == 1


def test_sets_that_lack_what_is_seen_are_wrong():
    scene = street()
    truth = ItemBuffer(4 * SMALL.rows, 4 * SMALL.columns)
    truth.draw(scene, looking())
    lacking = truth.visible[scene.names.index("beside")]
    drawn = flown(scene, [["wall"]]).total.drawn
    for way in Way:
        wrong = (1, lacking) if way in (Way.PVS, Way.BOTH) else (0, 0)
        assert (drawn[way].wrong_objects, drawn[way].wrong_pixels) == wrong
    assert lacking > 0


@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1))
def test_both_draw_no_more_than_either_and_a_plain_count_agrees(seed):
    rng = np.random.default_rng(seed)
    boxes = [box(rng.uniform(0.5, 5.0, 3), rng.uniform(-9.0, 9.0, 3)) for _ in range(20)]
    scene = scene_of(sphere(4.0, rings=12), *boxes)  # the ball is cut into parts
    occluders = {f"object {i}": exact(boxes[i - 1]) for i in range(1, 21, 2)}
    visible = [name for name in scene.names if rng.random() < 0.6]
    eyes = rng.uniform((-4.0, -14.0, 0.0), (9.0, -8.0, 5.0), (4, 3))
    found = flown(scene, [visible], *map(looking, eyes), occluders=occluders)
    for frame, eye in zip(found.frames, eyes, strict=True):
        drawn = frame.figures.drawn
        for count in ("objects", "triangles"):
            frustum, pvs, occluded, both = (getattr(drawn[way], count) for way in Way)
            assert both <= min(pvs, occluded) <= max(pvs, occluded) <= frustum
        plain = _plain_wrong(scene, found.sets, eye)
        assert (drawn[Way.PVS].wrong_objects, drawn[Way.PVS].wrong_pixels) == plain
        assert drawn[Way.FRUSTUM].wrong_pixels == 0


def _plain_wrong(scene, sets, eye):
    """Objects and pixels that show what the sets lack, by a loop over the pixels of a picture."""
    parts = split_large(scene)
    picture = ItemBuffer(4 * SMALL.rows, 4 * SMALL.columns)
    picture.draw(parts.scene, looking(eye))
    shown = [int(parts.object_of[item]) for item in picture.items.ravel().tolist() if item >= 0]
    seen = sets.seen_from(eye)
    lacking = [index for index in shown if not seen[index]]
    return len(set(lacking)), len(lacking)


@pytest.mark.parametrize(
    ("values", "spread"),
    [([5], Spread(5.0, 5.0, 5, 0)), ([1, 7, 7, 2], Spread(4.25, 4.5, 7, 1)),
     ([0, 0], Spread(0.0, 0.0, 0, 0))],
)  # fmt: skip
def test_spreads(values, spread):
    assert Spread.of(values) == spread
