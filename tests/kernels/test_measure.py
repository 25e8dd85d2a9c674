"""The exact form of the occlusion measure against scipy's distance transform and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.kernels.measure import distance_sum
from simplifier.selection.measure import directional_measures
from tests.kernels.bits import annulus, blob, disc, rectangle


def summed_by_scipy(mask):
    """Distances of the set pixels to the nearest background centre, less half a pixel each."""
    distances = ndimage.distance_transform_edt(np.pad(mask, 1))
    return float((distances - 0.5)[np.pad(mask, 1)].sum())


def agrees(mask):
    mask = np.ascontiguousarray(mask, dtype=np.bool_)
    return distance_sum(mask) == pytest.approx(summed_by_scipy(mask), rel=1e-12, abs=1e-12)


@settings(max_examples=150, deadline=None)
@given(
    st.integers(1, 70), st.integers(1, 70), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1),
    st.booleans(),
)  # fmt: skip
def test_random_masks(rows, columns, density, seed, dense):
    mask = np.random.default_rng(seed).random((rows, columns)) < density
    assert agrees(~mask | (mask.cumsum(axis=1) % 7 > 0) if dense else mask)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.95), st.sampled_from([2.0, 5.0, 12.0]))
def test_random_blobs(seed, share, smooth):
    assert agrees(blob(seed, share, smooth, side=91))


@pytest.mark.parametrize(
    "shape", [(1, 1), (1, 2), (2, 1), (1, 300), (300, 1), (2, 300), (64, 64), (37, 211)]
)
def test_full_and_empty_images(shape):
    assert agrees(np.ones(shape))
    assert distance_sum(np.zeros(shape, dtype=np.bool_)) == 0.0


def test_one_hole_in_a_large_image():
    mask = np.ones((150, 120), dtype=np.bool_)
    mask[41, 97] = False
    assert agrees(mask)


def test_images_without_pixels():
    assert distance_sum(np.zeros((0, 5), dtype=np.bool_)) == 0.0
    assert distance_sum(np.zeros((5, 0), dtype=np.bool_)) == 0.0


# The closed forms.  On straight edges the sum is the trapezoid rule, whose error is known.  On
# curved ones the nearest of many background centres is about a third of a pixel closer than the
# boundary and half a pixel: an error of one part in R.


@pytest.mark.parametrize("radius", [8, 16, 32, 64, 128, 256])
def test_disc(radius):
    measure = distance_sum(disc(radius, 2 * radius + 2))
    assert measure == pytest.approx(np.pi * radius**3 / 3, rel=1.25 / radius)


@pytest.mark.parametrize("side", [1, 2, 3, 8, 17, 64, 255])
def test_square(side):
    measure = distance_sum(rectangle(side, side, side + 1))
    assert measure == pytest.approx(side**3 / 6 + side / 3, rel=1e-12)


@pytest.mark.parametrize(("width", "height"), [(100, 20), (20, 100), (31, 7), (64, 63), (1, 9)])
def test_rectangle(width, height):
    short, long = sorted((width, height))
    error = short / 3 + (long - short) / 4 * (short % 2)
    expected = short**2 * long / 4 - short**3 / 12 + error
    assert distance_sum(rectangle(width, height, 128)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("inner", "outer"), [(10, 30), (20, 100), (60, 100)])
def test_annulus(inner, outer):
    expected = np.pi * (inner + outer) / 2 * (outer - inner) ** 2 / 2
    measure = distance_sum(annulus(inner, outer, 2 * outer + 4))
    assert measure == pytest.approx(expected, rel=1.25 / (outer - inner))


def test_a_stack_of_masks_in_the_unit_of_the_pixel():
    masks = np.stack([disc(20), rectangle(30, 11), np.zeros((64, 64), dtype=np.bool_)])
    expected = [summed_by_scipy(mask) * 0.25**3 for mask in masks]
    assert directional_measures(masks, 0.25) == pytest.approx(expected, rel=1e-12)
    assert directional_measures(np.empty((0, 8, 8), dtype=np.bool_)).shape == (0,)


def test_threads_do_not_change_the_measures(monkeypatch):
    masks = np.stack([blob(seed) for seed in range(40)])
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    one = directional_measures(masks)
    monkeypatch.setenv("OCCLUDER_THREADS", "7")
    assert np.array_equal(directional_measures(masks), one)
