"""A sphere of directions, unrolled."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.view_map import Axis, graticule, mollweide, place

ANGLES = st.floats(-math.pi, math.pi)


@given(ANGLES, st.floats(-math.pi / 2.0, math.pi / 2.0))
def test_every_place_lies_in_the_ellipse(longitude: float, latitude: float) -> None:
    x, y = mollweide(longitude, latitude)
    assert (x / 2.0) ** 2 + y**2 <= 1.0 + 1e-9


def test_areas_are_kept() -> None:
    """Of directions uniform on the sphere, as many are in any part of the map as its area asks."""
    random = np.random.default_rng(0)
    heights = random.uniform(-1.0, 1.0, 20_000)
    turns = random.uniform(-math.pi, math.pi, 20_000)
    places = [
        mollweide(float(turn), math.asin(height))
        for turn, height in zip(turns, heights, strict=True)
    ]
    inner = sum((x / 2.0) ** 2 + y**2 < 0.25 for x, y in places) / len(places)
    strip = sum(abs(y) < 0.5 for _, y in places) / len(places)
    assert inner == pytest.approx(0.25, abs=0.01)
    assert strip == pytest.approx((2.0 * math.pi / 6.0 + math.sqrt(0.75)) / math.pi, abs=0.01)


@pytest.mark.parametrize("up", get_args(Axis))
def test_viewers_above_are_at_the_top_and_the_front_is_in_the_middle(up: Axis) -> None:
    down = tuple(-1.0 if axis == up else 0.0 for axis in "xyz")
    assert place(down, up)[1] == pytest.approx(1.0)  # type: ignore[arg-type]
    front = (0.0, 1.0, 0.0) if up == "z" else (0.0, 0.0, -1.0)
    assert place(front, up) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_viewer_on_the_right_is_on_the_right() -> None:
    x, y = place((-1.0, 0.0, 0.0), "y")
    assert (x, y) == pytest.approx((1.0, 0.0), abs=1e-9)


def test_the_graticule_ends_at_the_edge() -> None:
    ends = [line[0] for line in graticule()] + [line[-1] for line in graticule()]
    assert all((x / 2.0) ** 2 + y**2 == pytest.approx(1.0, abs=1e-6) for x, y in ends)
