"""Histograms: the bars are where the values are, the marks where they say."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.report.gallery import precision_histogram, recall_histogram, zoomed_axis_start

BAR, WORST = (0x5B, 0x8D, 0xEF), (0xC0, 0x26, 0x2D)
LEFT, RIGHT = 0.09 * 720, 0.94 * 720  # ends of the axis in the picture, pixels


def decoded(data: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def columns_of(picture, colour, rows=slice(60, 300)):
    """Columns in which at least ten pixels have the colour."""
    return np.nonzero((picture[rows] == np.array(colour)).all(axis=2).sum(axis=0) >= 10)[0]


def share_of(column, low, high):
    """Value that a column of pixels stands for; the axis has a margin of one part in a hundred."""
    span = high - low
    return low - 0.01 * span + (column - LEFT) / (RIGHT - LEFT) * 1.02 * span


@pytest.mark.parametrize("value", [0.1, 0.5, 0.9, 1.0])
def test_bar_of_equal_recalls_stands_at_their_value(value):
    columns = columns_of(decoded(recall_histogram(np.full(20, value))), BAR)
    assert share_of(columns[0], 0.0, 1.0) < value + 0.01
    assert share_of(columns[-1], 0.0, 1.0) > value - 0.04
    assert share_of(columns[-1], 0.0, 1.0) - share_of(columns[0], 0.0, 1.0) < 0.05


def test_worst_is_marked_at_its_value():
    values = np.concatenate([np.full(50, 0.8), [0.25]])
    columns = columns_of(decoded(recall_histogram(values)), WORST, slice(60, 280))
    assert np.abs(share_of(columns, 0.0, 1.0) - 0.25).max() < 0.01


def test_median_is_marked_at_its_value():
    values = np.array([0.2, 0.6, 0.6, 0.6, 0.9])
    picture = decoded(recall_histogram(values))
    dark = np.nonzero((picture[70:290].max(axis=2) < 60).sum(axis=0) >= 60)[0]
    inner = dark[(dark > LEFT + 10) & (dark < RIGHT - 10)]
    assert np.abs(share_of(inner, 0.0, 1.0) - 0.6).max() < 0.01


@pytest.mark.parametrize("worst", [0.9996, 0.99, 0.3])
def test_no_label_is_cut_at_the_border(worst):
    """Of "100.000 %" the sign was."""
    picture = decoded(precision_histogram(np.array([worst, 1.0])))
    for border in (picture[:3], picture[-3:], picture[:, :3], picture[:, -3:]):
        assert (border == 255).all()


def test_precision_is_zoomed_to_where_it_is():
    """At 99.6 to 99.9 % an axis from 0 would show one bar; this one spreads over most of it."""
    values = np.linspace(0.996, 0.999, 256)
    columns = columns_of(decoded(precision_histogram(values)), BAR)
    assert columns[-1] - columns[0] > 0.5 * (RIGHT - LEFT)
    assert share_of(columns[0], 0.995, 1.0) == pytest.approx(0.996, abs=3e-4)


@settings(max_examples=200, deadline=None)
@given(st.floats(0.0, 1.0))
def test_zoom_holds_the_worst_and_is_a_round_width(worst):
    low = zoomed_axis_start(worst)
    assert 0.0 <= low <= worst
    width = 1.0 - low
    assert width >= 0.001 * (1.0 - 1e-9)
    if worst < 0.999:
        assert width <= 2.5 * (1.0 - worst) * (1.0 + 1e-9)
    mantissa = width / 10.0 ** math.floor(math.log10(width) + 1e-9)
    assert min(abs(mantissa - round_value) for round_value in (1.0, 2.0, 5.0)) < 1e-6


@pytest.mark.parametrize(
    ("worst", "low"), [(1.0, 0.999), (0.9999, 0.999), (0.99, 0.99), (0.9, 0.9), (0.4, 0.0)]
)
def test_zoom_examples(worst, low):
    assert zoomed_axis_start(worst) == pytest.approx(low, abs=1e-12)


@pytest.mark.parametrize("draw", [recall_histogram, precision_histogram])
@pytest.mark.parametrize("values", [[0.5], [0.0], [1.0], [0.0, 1.0]])
def test_few_views_and_extreme_values_are_drawn(draw, values):
    """A bar at each value, none anywhere else, and nothing past the ends of the axis."""
    columns = columns_of(decoded(draw(np.array(values))), BAR)
    low = zoomed_axis_start(min(values)) if draw is precision_histogram else 0.0
    found = share_of(columns, low, 1.0)
    bar = (1.0 - low) / 20.0
    for value in values:
        assert np.abs(found - value).min() < bar
    for place in found:
        assert min(abs(place - value) for value in values) < bar
    assert LEFT - 1 <= columns.min() <= columns.max() <= RIGHT + 1


def test_same_values_same_bytes():
    values = np.random.default_rng(1).random(64)
    assert recall_histogram(values) == recall_histogram(values)
