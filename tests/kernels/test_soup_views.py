"""Pictures and scores of triangle soups: pixel by pixel, and by erosions in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.soup_views import (
    FRONT_ROWS,
    INSET,
    UNIT,
    digit_count,
    draw_soup,
    draw_union,
    empty_pictures,
    exchange_picture,
    remove_useless,
    score_unions,
    unite_others,
)
from tests.kernels.bits import blob, eroded_areas, packed, unpacked
from tests.pictures import sphere_projections

VIEWS = 5
FREE = np.zeros((VIEWS, 2), np.int64)
NO_DEPTHS = (
    np.empty((0, 4)), np.empty((0, FRONT_ROWS, 64), np.float32),
    np.empty((0, FRONT_ROWS), np.float32),
)  # fmt: skip


def soup(seed, count):
    """Random triangles in a ball of radius 10 about the origin."""
    corners = np.random.default_rng(seed).normal(size=(count, 3, 3)) * 3.0
    return np.clip(corners, -5.5, 5.5)


def projections(views=VIEWS):
    return sphere_projections(image_axes(hemisphere_directions(views)), np.zeros(3), 10.0)


def drawn(triangles, views, beside=None):
    images, layers = empty_pictures(len(triangles), len(views), 64)
    standing = np.zeros((len(views), 64), np.uint64) if beside is None else beside
    draw_soup(triangles, views, NO_DEPTHS, standing, images, layers)
    return images, layers


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
    images, layers = drawn(triangles, views)
    for index, triangle in enumerate(triangles):
        for view, image in zip(views, images[index], strict=True):
            assert np.array_equal(unpacked(image), covered_pixels(triangle, view))
    union = np.bitwise_or.reduce(images, axis=0)
    assert np.array_equal(layers[:, 0], union)
    beside = np.zeros_like(union)
    beside[:, ::3] = 5
    draw_union(triangles, views, NO_DEPTHS, beside)
    union[:, ::3] |= np.uint64(5)
    assert np.array_equal(beside, union)


def counted(pictures):
    """(V, 2 + d, 64) layers, pixel by pixel, of pictures (n, V, 64)."""
    there = np.array([[unpacked(image) for image in views] for views in pictures])
    number = there.sum(axis=0)
    digits = [number >> place & 1 for place in range(digit_count(len(pictures) - 1))]
    layers = np.stack([number > 0, number > 1, *digits], axis=1)
    return np.array([[packed(layer > 0) for layer in view] for view in layers])


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 99))
def test_all_but_one(seed, count):
    images, layers = drawn(soup(seed, count), projections())
    others = np.empty(images.shape[1:], np.uint64)
    for index in range(count):
        unite_others(index, images, layers, others)
        rest = np.delete(images, index, axis=0)
        assert np.array_equal(others, np.bitwise_or.reduce(rest, axis=0, initial=0))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 70), st.booleans())
def test_layers_count_the_pictures_while_they_are_exchanged(seed, count, stands):
    rng, views = np.random.default_rng(seed), projections()
    standing = drawn(soup(seed + 1, 3), views)[1][:, 0] * np.uint64(stands)
    images, layers = drawn(soup(seed, count), views, standing)
    assert np.array_equal(layers, counted([*images, standing]))
    others = drawn(soup(seed + 2, 12), views)[0]
    for new in others:
        index = rng.integers(count)
        for view in range(VIEWS):
            exchange_picture(layers[view], images[index, view], new[view], np.uint64(255))
        assert np.array_equal(images[index], new)
    assert np.array_equal(layers, counted([*images, standing]))


def test_as_many_digits_as_the_triangles_and_what_stands_beside_them_need():
    assert [digit_count(count) for count in (0, 1, 2, 3, 6, 7, 62, 63, 1023)] == [
        1, 2, 2, 3, 3, 4, 6, 7, 11,
    ]  # fmt: skip


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 99))
def test_what_stands_beside_a_soup_is_in_every_union(seed, count):
    triangles, views = soup(seed, count), projections()
    standing = drawn(soup(seed + 1, 3), views)[1][:, 0].copy()
    images, own = drawn(triangles, views)
    _, layers = drawn(triangles, views, standing)
    others, alone = np.empty((2, *images.shape[1:]), np.uint64)
    for index in range(count):
        unite_others(index, images, layers, others)
        unite_others(index, images, own, alone)
        assert np.array_equal(others, alone | standing)


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
    images, layers = drawn(triangles, projections())
    originals = np.stack([packed(blob(seed + view, 0.6)) for view in range(VIEWS)])
    before = score(images, originals, price)
    scores = np.zeros(VIEWS, np.int64)
    score_unions(np.bitwise_or.reduce(images, axis=0), originals, price, FREE, scores)
    kept = np.zeros(len(triangles), np.bool_)
    remove_useless(images, layers, originals, price, FREE, scores, kept)
    assert not kept[4]
    assert not kept[7]
    left, _ = drawn(np.ascontiguousarray(triangles[kept]), projections())
    after = score(left, originals, price) if kept.any() else 0
    assert after == scores.sum() >= before
    for index in range(len(left)):
        assert score(np.delete(left, index, axis=0), originals, price) < after
