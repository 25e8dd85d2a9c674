"""Pictures and scores of triangle soups: pixel by pixel, and by erosions in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.bit_image import measure_both_twice, measure_twice
from simplifier.kernels.soup_views import (
    INSET,
    UNIT,
    block_count,
    draw_soup,
    remove_useless,
    score_unions,
    unite_others,
)
from simplifier.refinement.depths import NO_DEPTHS
from tests.kernels.bits import blob, eroded_areas, packed, unpacked
from tests.pictures import sphere_projections

VIEWS = 5
FREE = np.zeros((VIEWS, 2), np.int64)


def soup(seed, count):
    """Random triangles in a ball of radius 10 about the origin."""
    corners = np.random.default_rng(seed).normal(size=(count, 3, 3)) * 3.0
    return np.clip(corners, -5.5, 5.5)


def projections(views=VIEWS):
    return sphere_projections(image_axes(hemisphere_directions(views)), np.zeros(3), 10.0)


def drawn(triangles, views):
    images = np.zeros((len(triangles), len(views), 64), np.uint64)
    blocks = np.zeros((block_count(len(triangles)), len(views), 64), np.uint64)
    draw_soup(triangles, views, NO_DEPTHS.arrays(), images, blocks)
    return images, blocks


def covered_pixels(triangle, view):
    """(64, 64) bool: pixel centres inside the projected triangle, by the inset from every side."""
    p, q, r = triangle @ view[:, :3].T + view[:, 3]
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5)

    def left(a, b):
        """The distance to the left of a -> b."""
        side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        return side / np.hypot(*(b - a))

    sides = np.array([left(p, q), left(q, r), left(r, p)])
    return np.all(sides > INSET, axis=0) | np.all(sides < -INSET, axis=0)


def plain_score(masks, originals, price, fines=FREE):
    """What the views score, by the formula."""
    total = 0
    for mask, original, (fine, _) in zip(masks, originals, fines.tolist(), strict=True):
        right = eroded_areas(mask & original)
        wrong = eroded_areas(mask) - right
        total += UNIT * right - price * wrong - fine * int((mask & ~original).sum())
    return total


def score(images, originals, price, fines=FREE):
    scores = np.zeros(len(originals), np.int64)
    unions = np.bitwise_or.reduce(images, axis=0)
    total = score_unions(unions, originals, price, fines, scores)
    assert total == scores.sum()
    return total


@pytest.mark.parametrize("seed", range(4))
def test_pictures_hold_the_pixels_inside(seed):
    triangles, views = soup(seed, 11), projections()
    images, blocks = drawn(triangles, views)
    for index, triangle in enumerate(triangles):
        for view, image in zip(views, images[index], strict=True):
            assert np.array_equal(unpacked(image), covered_pixels(triangle, view))
    assert np.array_equal(
        np.bitwise_or.reduce(blocks, axis=0), np.bitwise_or.reduce(images, axis=0)
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 99))
def test_all_but_one(seed, count):
    images, blocks = drawn(soup(seed, count), projections())
    others = np.empty(images.shape[1:], np.uint64)
    for index in range(-1, count):
        unite_others(index, images, blocks, others)
        rest = np.delete(images, index, axis=0) if index >= 0 else images
        assert np.array_equal(others, np.bitwise_or.reduce(rest, axis=0, initial=0))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 99))
def test_what_stands_beside_a_soup_is_in_every_union_and_drawing_leaves_it(seed, count):
    triangles, views = soup(seed, count), projections()
    images, own = drawn(triangles, views)
    standing = drawn(soup(seed + 1, 3), views)[1]
    blocks = np.concatenate([own, standing])
    draw_soup(triangles, views, NO_DEPTHS.arrays(), images, blocks)
    assert np.array_equal(blocks, np.concatenate([own, standing]))
    others, alone = np.empty((2, *images.shape[1:]), np.uint64)
    for index in range(-1, count):
        unite_others(index, images, blocks, others)
        unite_others(index, images, own, alone)
        assert np.array_equal(others, alone | standing[0])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), st.floats(0.02, 0.98))
def test_two_measures_at_once_are_those_of_one(seed, other, share):
    whole = packed(blob(seed, share))
    part = packed(unpacked(whole) & blob(other, 0.6))

    def framed(image):
        return np.pad(image, 1)

    def scratch():
        return np.zeros(66, np.uint64)

    both = measure_both_twice(framed(whole), framed(part), scratch(), scratch())
    assert both == (
        measure_twice(framed(whole), scratch()),
        measure_twice(framed(part), scratch()),
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 100), st.floats(0.1, 0.9))
def test_scores_follow_the_formula(seed, price, share):
    images, _ = drawn(soup(seed, 6), projections())
    originals = [blob(seed + view, share) for view in range(VIEWS)]
    masks = [unpacked(image) for image in np.bitwise_or.reduce(images, axis=0)]
    bits = np.stack([packed(original) for original in originals])
    assert score(images, bits, price) == plain_score(masks, originals, price)
    fines = np.random.default_rng(seed).integers(0, 5000, (VIEWS, 2))
    assert score(images, bits, price, fines) == plain_score(masks, originals, price, fines)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 40))
def test_what_adds_nothing_goes_and_nothing_is_lost(seed, price):
    triangles = soup(seed, 9)
    triangles[4] = triangles[2]  # a duplicate
    triangles[7, 2] = triangles[7, 1]  # no area
    images, blocks = drawn(triangles, projections())
    originals = np.stack([packed(blob(seed + view, 0.6)) for view in range(VIEWS)])
    before = score(images, originals, price)
    scores = np.zeros(VIEWS, np.int64)
    score_unions(np.bitwise_or.reduce(images, axis=0), originals, price, FREE, scores)
    kept = np.zeros(len(triangles), np.bool_)
    remove_useless(images, blocks, originals, price, FREE, scores, kept)
    assert not kept[4]
    assert not kept[7]
    left, _ = drawn(np.ascontiguousarray(triangles[kept]), projections())
    after = score(left, originals, price) if kept.any() else 0
    assert after == scores.sum() >= before
    for index in range(len(left)):
        assert score(np.delete(left, index, axis=0), originals, price) < after
