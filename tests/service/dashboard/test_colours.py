"""Colours of shares."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.colours import STOPS, Scale, css

SHARES = st.floats(0.0, 1.0)


@given(st.lists(SHARES, min_size=1), SHARES, SHARES)
def test_better_is_never_darker(values: list[float], a: float, b: float) -> None:
    scale, (low, high) = Scale.over(values), sorted((a, b))
    assert _light(scale.colour(low)) <= _light(scale.colour(high)) + 2.0


def test_the_ends_are_the_ends_of_the_ramp() -> None:
    scale = Scale(0.5, 0.9)
    assert scale.colour(0.5) == STOPS[0]
    assert scale.colour(0.9) == STOPS[-1]
    assert scale.colour(0.7) == STOPS[4]


def test_values_that_are_all_equal_are_all_best() -> None:
    assert Scale.over([0.3, 0.3]).colour(0.3) == STOPS[-1]


@pytest.mark.parametrize(("colour", "text"), [((0, 34, 78), "#00224e"), ((255, 0, 9), "#ff0009")])
def test_css_has_six_digits(colour: tuple[int, int, int], text: str) -> None:
    assert css(colour) == text


def _light(colour: tuple[int, int, int]) -> float:
    red, green, blue = colour
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
