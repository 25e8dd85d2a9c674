"""What is written in LLVM's instructions does what its function of Python does, bit by bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels import soup_views
from simplifier.kernels.soup_views import (
    BLOCK,
    FRONT_ROWS,
    OUTLINE_NUMBERS,
    UNIT,
    block_size,
    draw_found,
    draw_triangle,
    exchange_picture,
    find_outlines,
    put_projection,
    score_exchange,
    score_view,
)
from tests.kernels.bits import blob, packed, unpacked
from tests.kernels.test_soup_views import covered_pixels, projections, soup

SEEDS = st.integers(0, 2**32 - 1)
HEIGHTS = st.sampled_from([64, 64 + FRONT_ROWS])
ONE_VIEW = projections(1)[0]


def pictures(rng, count, height):
    """(count, height) uint64: random triangles' pictures, and dots where rows are past those."""
    dots = rng.integers(0, 2**64, (count, height), np.uint64)
    dots &= rng.integers(0, 2**64, (count, height), np.uint64)
    for dot, triangle in zip(dots, soup(rng.integers(2**32), count), strict=True):
        dot[:64] = packed(covered_pixels(triangle, ONE_VIEW))
    return dots


def counted(images):
    """(2 + d, height) layers of pictures, one after the other, by the function of Python."""
    digits = (len(images) + 1).bit_length()
    layers = np.zeros((2 + digits, images.shape[1]), np.uint64)
    for image in images:
        exchange(layers, np.zeros_like(image), image)
    return layers


def exchange(layers, old, new):
    """By the function of Python."""
    soup_views._exchange(layers, len(layers) - 2, layers.shape[1], old, new, 0)


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 40), HEIGHTS)
def test_a_picture_is_exchanged(seed, count, height):
    rng = np.random.default_rng(seed)
    images, (new,) = pictures(rng, count, height), pictures(rng, 1, height)
    new[rng.random(height) < 0.5] = 0
    layers, old = counted(images), images[0].copy()
    differ = (old != new).reshape(-1, 8).any(axis=1)
    plainly, plainly_old = layers.copy(), old.copy()
    exchange(plainly, plainly_old, new)
    # Eights that are named for nothing change nothing.
    named = differ | (rng.random(len(differ)) < 0.3)
    exchange_picture(layers, old, new, np.uint64(sum(1 << k for k in np.flatnonzero(named))))
    assert np.array_equal(layers, plainly)
    assert np.array_equal(old, new)
    assert np.array_equal(layers, counted(np.concatenate([new[None], images[1:]])))


@pytest.mark.parametrize("count", [1, 2, 3, 7, 62, 63])
def test_the_last_digit_is_carried_into(count):
    full = np.full((count, 64), 2**64 - 1, np.uint64)
    layers = counted(full)
    assert [int(layer[0] & np.uint64(1)) for layer in layers[2:]] == [
        count >> place & 1 for place in range(len(layers) - 2)
    ]
    for image in full:
        exchange_picture(layers, image, np.zeros(64, np.uint64), np.uint64(255))
    assert not layers.any()


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 40), HEIGHTS, st.integers(0, 100), st.integers(0, 5000))
def test_a_view_is_scored(seed, count, height, price, fine):
    rng = np.random.default_rng(seed)
    images, (new,) = pictures(rng, count, height), pictures(rng, 1, height)
    original = packed(blob(seed % 1000, rng.uniform(0.1, 0.9)))
    if rng.random() < 0.3:
        original |= np.bitwise_or.reduce(images)[:64] | new[:64]  # nothing is beside it
    union = np.bitwise_or.reduce(images[1:], axis=0, initial=0) | new
    plain = soup_views._score_view(union, original, price, fine).astype(np.int64)
    assert score_view(union, original, price, fine) == plain
    layers = counted(images)
    assert score_exchange(layers, images[0], new, original, price, fine) == plain
    by_python = soup_views._score_exchange(layers, height, images[0], new, original, price, fine)
    assert by_python.astype(np.int64) == plain
    assert score_view(original, original, price, fine) >= plain
    assert not score_view(np.zeros(height, np.uint64), original, price, fine)


def test_a_score_may_be_negative():
    nothing, everything = np.zeros(64, np.uint64), np.full(64, 2**64 - 1, np.uint64)
    score = score_view(everything, nothing, UNIT, 7)
    assert score == soup_views._score_view(everything, nothing, UNIT, 7).astype(np.int64) < 0


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 70), HEIGHTS, st.floats(0.02, 4.0))
def test_a_triangle_is_drawn_in_a_run_of_views(seed, views, height, size):
    """Its pictures are those of the triangle alone, also past the borders, and what each does to
    the union is told."""
    rng, turns = np.random.default_rng(seed), projections(views)
    blocks, outlines = np.empty(block_size(views)), np.empty(OUTLINE_NUMBERS * BLOCK)
    for view in range(views):
        put_projection(turns[view], view, blocks)
    before = rng.normal(size=(3, 3)) * 3.0 * size
    after = before.copy()
    after[rng.integers(3)] += rng.normal(size=3) * rng.choice([0.01, 1.0, 30.0])
    first = int(rng.integers(views))
    end = int(rng.integers(first, min(views, (first // BLOCK + 1) * BLOCK)) + 1)
    find_outlines(*map(tuple, after), before, blocks, first, end, outlines)
    for view in range(first, end):
        own, alone = np.zeros((2, height), np.uint64)
        draw_triangle(*map(tuple, before), turns[view], own)
        draw_triangle(*map(tuple, after), turns[view], alone)
        others = pictures(rng, 3, height)
        layers = counted(np.concatenate([own[None], others]))
        new, plainly = rng.integers(0, 2**64, (2, height), np.uint64)
        eights, plain_eights = np.full((2, 1), 99, np.uint64)
        differs = draw_found(outlines, view - first, layers, own, new, eights)
        assert np.array_equal(new[:64], alone[:64])
        assert np.array_equal(unpacked(new[:64]), covered_pixels(after, turns[view]))
        rest = np.bitwise_or.reduce(others, axis=0)[:64]
        change = (rest | new[:64]) ^ (rest | own[:64])
        assert differs == np.bitwise_or.reduce(change)
        rows = (new[:64] != own[:64]).reshape(8, 8).any(axis=1)
        assert eights[0] == sum(1 << k for k in np.flatnonzero(rows))
        assert differs == soup_views._draw_found(
            outlines, view - first, layers, height, own, plainly, plain_eights
        )
        assert np.array_equal(plainly[:64], new[:64])
        assert plain_eights == eights
