"""Points between two planes, beside a plain form in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.room import EVERYWHERE
from simplifier.kernels.slab import keep_between

NORMALS = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, -0.8], [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]])
lengths = st.floats(-50.0, 50.0)


def kept(point, slab):
    moved = np.array(point, dtype=np.float64)
    keep_between(moved, np.array(slab))
    return moved


@given(st.tuples(lengths, lengths, lengths), st.integers(0, 2), lengths, st.floats(0.0, 9.0))
def test_a_point_moves_straight_to_the_nearest_plane(point, which, low, thick):
    normal, point = NORMALS[which], np.array(point)
    along = point @ normal
    wanted = point + (np.clip(along, low, low + thick) - along) * normal
    found = kept(point, [*normal, low, low + thick])
    assert found == pytest.approx(wanted, abs=1e-12)
    assert low - 1e-12 <= found @ normal <= low + thick + 1e-12


@given(st.tuples(lengths, lengths, lengths))
def test_what_is_between_the_planes_stays_to_the_bit(point):
    for slab in ((0.0, 0.0, 1.0, -51.0, 51.0), EVERYWHERE):
        assert np.array_equal(kept(point, slab), point)
