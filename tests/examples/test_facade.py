"""Bodies with windows are closed, and lose the volume of their recesses and no more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from examples.facade import Facade, body, rectangle, storeys
from tests.examples.test_building import open_edges, volume


@settings(max_examples=40, deadline=None)
@given(
    st.floats(5.0, 40.0),
    st.floats(5.0, 40.0),
    st.integers(1, 6),
    st.sampled_from([0.0, 1.1, 2.0]),
    st.floats(0.1, 0.6),
    st.sets(st.integers(0, 3)),
)
def test_a_body_is_its_box_without_the_recesses(width, depth, count, window, recess, blank):
    height, rows = storeys(count)
    facade = Facade(rows, window, 3.0, recess)
    part = body([rectangle(width, depth)], -1.0, height - 1.0, facade, tuple(blank))
    assert open_edges(part) == []
    lengths = [side for edge, side in enumerate([width, depth] * 2) if edge not in blank]
    tall = sum(high - low for low, high in rows)
    glass = sum(tall * np.diff(facade.columns(side)).sum() for side in lengths)
    assert volume(part) == pytest.approx(width * depth * height - glass * recess, rel=1e-5)


def test_a_courtyard_has_windows_on_its_inner_walls():
    _, rows = storeys(3)
    rings = [rectangle(40.0, 30.0), rectangle(20.0, 12.0)[::-1]]
    inner = body(rings, 0.0, 11.0, Facade(rows), blank=(0, 1, 2, 3))
    assert open_edges(inner) == []
    plain = body(rings, 0.0, 11.0)
    assert volume(plain) == pytest.approx(11.0 * (1200.0 - 240.0), rel=1e-6)
    assert volume(inner) < volume(plain) - 10.0


def test_a_rectangle_s_edges_face_as_promised():
    """Blank all but one: the recesses lie behind that side alone."""
    for edge, (axis, sign) in enumerate([(2, 1.0), (0, 1.0), (2, -1.0), (0, -1.0)]):
        others = [other for other in range(4) if other != edge]
        part = body([rectangle(20.0, 20.0)], 0.0, 9.0, Facade(((2.0, 4.0),), recess=0.5), others)
        deep = part.vertices[np.abs(part.vertices[:, axis] * sign - 9.5) < 1e-6]
        assert len(deep) > 8


def test_windows_stay_below_the_top_and_clear_of_the_corners():
    facade = Facade(((1.0, 2.0), (5.0, 9.0)), 1.0, 2.0)
    part = body([rectangle(12.0, 10.0)], 0.0, 9.2, facade)
    assert part.vertices[(part.vertices[:, 1] > 2.1)][:, 1].min() == pytest.approx(9.2)
    columns = facade.columns(12.0)
    assert columns.min() >= 0.9
    assert columns.max() <= 12.0 - 0.9
    assert facade.columns(2.5).shape == (0, 2)
