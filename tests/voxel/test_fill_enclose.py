"""What is inside, and which remedy closed how much of it."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.solid import Closing
from simplifier.voxel.fill import enclose, fill
from simplifier.voxel.voxelize import voxelize
from tests.solids import box, joined

GROUND = frozenset({(1, 0)})
NOTHING = frozenset()


def vessels():
    """One box without a floor, one whose lid has a gap."""
    gap = [box((0.4, 0.0, 1.0), (x, 1.0, 0.0), without=[0, 1, 2, 4, 5]) for x in (2.0, 2.6)]
    return voxelize(joined(box(without=[2]), box((1, 1, 1), (2, 0, 0), without=[3]), *gap), 60)


def test_each_remedy_tells_what_it_added():
    touched = vessels()
    one = 16**3  # voxels of a vessel, about
    filled, closings = enclose(touched, NOTHING, 0.0)
    assert np.array_equal(filled.inside, fill(touched).inside)
    assert closings == ()
    filled, closings = enclose(touched, GROUND, 0.0)
    assert [closing.by for closing in closings] == ["ground"]
    filled, closings = enclose(touched, GROUND, 4.0)
    assert [closing.by for closing in closings] == ["ground", "smallest_hole"]
    assert all(one < closing.voxels < 2 * one for closing in closings)
    assert sum(closing.voxels for closing in closings) == filled.count - fill(touched).count
    _, (hole,) = enclose(touched, NOTHING, 4.0)
    assert hole.by == "smallest_hole"
    assert one < hole.voxels < 2 * one


def test_a_remedy_that_adds_nothing_is_told_too():
    touched = voxelize(box(), 20)
    filled, closings = enclose(touched, GROUND, 3.0)
    assert closings == (Closing("ground", 0), Closing("smallest_hole", 0))
    assert np.array_equal(filled.inside, fill(touched).inside)


def test_nothing_of_the_plain_fill_is_lost():
    for seed in range(20):
        inside = np.random.default_rng(seed).random((9, 10, 11)) < 0.45
        touched = voxelize(box(), 10).with_inside(inside)
        filled, _ = enclose(touched, GROUND, 2.5)
        assert (filled.inside >= fill(touched, GROUND).inside).all()
