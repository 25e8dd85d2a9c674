"""Quads: sampled and exact sums against the enumeration of every pair of corners."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.random_quads import exact_quad_pixels, sampled_quad_pixels


def packed(masks):
    """(V, rows, columns) bool to bit rows."""
    views, rows, columns = masks.shape
    wide = np.zeros((views, rows, -(-columns // 64) * 64), np.uint8)
    wide[:, :, :columns] = masks
    return np.packbits(wide, axis=-1, bitorder="little").view("<u8").astype(np.uint64)


def bounding_slices(mask):
    rows = np.nonzero(mask.any(axis=1))[0]
    columns = np.nonzero(mask.any(axis=0))[0]
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def every_quad(original, occluder):
    """(pairs, 3): Nt, Pf, Nf of the quad of every ordered pair of corner pixels."""
    box = bounding_slices(original)
    p, q = original[box], occluder[box]
    outcomes = []
    pixels = list(np.ndindex(p.shape))
    for (y0, x0), (y1, x1) in itertools.product(pixels, pixels):
        quad = slice(min(y0, y1), max(y0, y1) + 1), slice(min(x0, x1), max(x0, x1) + 1)
        area = p[quad].size
        in_original, in_occluder = p[quad].all(), q[quad].all()
        outcomes.append(
            (
                area * (in_original and in_occluder),
                area * (in_original and not in_occluder),
                (area - p[quad].sum()) * (in_occluder and not in_original),
            )
        )
    return np.array(outcomes, dtype=np.float64)


def by_rectangles(original, occluder):
    """The same expectation, rectangle by rectangle: for masks too large to pair all corners."""
    box = bounding_slices(original)
    p, q = original[box].astype(int), occluder[box].astype(int)
    height, width = p.shape
    sums = np.zeros(3)
    for low, high in itertools.combinations(range(height + 1), 2):
        table_p = np.concatenate([[0], np.cumsum(p[low:high].sum(axis=0))])
        table_q = np.concatenate([[0], np.cumsum(q[low:high].sum(axis=0))])
        left, right = np.triu_indices(width + 1, 1)
        area = (right - left) * (high - low)
        weight = (1 + (right - left > 1)) * (1 + (high - low > 1))
        in_p = table_p[right] - table_p[left]
        full_p, full_q = in_p == area, table_q[right] - table_q[left] == area
        sums += [
            (weight * area)[full_p & full_q].sum(),
            (weight * area)[full_p & ~full_q].sum(),
            (weight * (area - in_p))[full_q & ~full_p].sum(),
        ]
    return sums / (height * width) ** 2


@st.composite
def mask_pairs(draw):
    rows, columns = draw(st.integers(1, 5)), draw(st.integers(1, 6))
    bits = st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns)
    masks = [np.array(draw(bits)).reshape(rows, columns) for _ in range(2)]
    masks[0][draw(st.integers(0, rows - 1)), draw(st.integers(0, columns - 1))] = True
    return masks


@settings(max_examples=120, deadline=None)
@given(mask_pairs())
def test_exact_is_the_mean_over_all_pairs_of_corners(masks):
    original, occluder = masks
    expected = every_quad(original, occluder).mean(axis=0)
    found = exact_quad_pixels(packed(original[None]), packed(occluder[None]), original.shape[1])
    np.testing.assert_allclose(found[0], expected, rtol=1e-13, atol=0)


@settings(max_examples=25, deadline=None)
@given(mask_pairs(), st.integers(0, 2**64 - 1))
def test_sampled_is_within_six_standard_errors(masks, seed):
    original, occluder = masks
    outcomes = every_quad(original, occluder)
    quads = 20_000
    found = sampled_quad_pixels(
        packed(original[None]), packed(occluder[None]), original.shape[1], quads=quads, seed=seed
    )
    error = outcomes.std(axis=0) / np.sqrt(quads)
    # The absolute term is for outcomes so rare that the sum is a Poisson count.
    assert (np.abs(found[0] - outcomes.mean(axis=0)) <= 6.0 * error + 1e-3).all()


def blobs(rows, columns, seed):
    """Ragged, holed masks that overlap in part, words wide."""
    generator = np.random.default_rng(seed)
    y, x = np.mgrid[:rows, :columns]
    masks = []
    for shift in (0.0, 2.5):
        r = np.hypot((y - rows / 2) / rows, (x - columns / 2 - shift) / columns)
        masks.append((r < 0.4) & (generator.random((rows, columns)) < 0.97))
    return masks


@pytest.mark.parametrize(("rows", "columns"), [(11, 150), (40, 64), (33, 65)])
def test_exact_on_masks_of_several_words(rows, columns):
    pairs = [blobs(rows, columns, seed) for seed in range(3)]
    original = np.array([pair[0] for pair in pairs])
    occluder = np.array([pair[1] for pair in pairs])
    found = exact_quad_pixels(packed(original), packed(occluder), columns)
    for row, pair in zip(found, pairs, strict=True):
        expected = by_rectangles(*pair)
        assert (expected > 0).all()
        np.testing.assert_allclose(row, expected, rtol=1e-12)


def test_the_two_references_agree():
    original, occluder = blobs(7, 9, 0)
    np.testing.assert_allclose(
        by_rectangles(original, occluder), every_quad(original, occluder).mean(axis=0)
    )


def test_sampled_tends_to_exact():
    original, occluder = (np.array([mask]) for mask in blobs(200, 230, 5))
    exact = exact_quad_pixels(packed(original), packed(occluder), 230)
    found = sampled_quad_pixels(packed(original), packed(occluder), 230, quads=2_000_000, seed=1)
    # Quads that fit are rare in a holed mask, so the error is some percent, not a per mille.
    np.testing.assert_allclose(found, exact, rtol=0.05)
    assert (found != exact).all()


def test_place_in_the_image_does_not_matter():
    original, occluder = blobs(30, 40, 2)
    wide = np.zeros((2, 90, 140), bool)
    wide[0, 50:80, 77:117], wide[1, 50:80, 77:117] = original, occluder
    wide[1, :, 120:] = True  # outside of the original's box: no quad goes there
    small = packed(original[None]), packed(occluder[None]), 40
    large = packed(wide[:1]), packed(wide[1:]), 140
    assert (exact_quad_pixels(*small) == exact_quad_pixels(*large)).all()
    sampled = [sampled_quad_pixels(*masks, quads=999, seed=3) for masks in (small, large)]
    assert (sampled[0] == sampled[1]).all()


def test_empty_masks_count_nothing():
    nothing = packed(np.zeros((2, 4, 5), bool))
    everything = packed(np.ones((2, 4, 5), bool))
    for count in (
        lambda a, b: exact_quad_pixels(a, b, 5),
        lambda a, b: sampled_quad_pixels(a, b, 5, quads=100, seed=0),
    ):
        assert (count(nothing, everything) == 0).all()
        pixels = count(everything, nothing)
        assert (pixels[:, 0] == 0).all()
        assert (pixels[:, 1] > 0).all()


def test_neither_threads_nor_blocks_change_the_sample(monkeypatch):
    pairs = [blobs(20, 70, seed) for seed in range(9)]
    original = packed(np.array([pair[0] for pair in pairs]))
    occluder = packed(np.array([pair[1] for pair in pairs]))
    whole = sampled_quad_pixels(original, occluder, 70, quads=3000, seed=7)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    tail = sampled_quad_pixels(original[4:], occluder[4:], 70, quads=3000, seed=7, first_view=4)
    assert (tail == whole[4:]).all()
    other = sampled_quad_pixels(original, occluder, 70, quads=3000, seed=8)
    assert (other != whole).any()


def test_views_and_seeds_draw_different_quads():
    # The same mask in every view: equal sums would mean equal random numbers.
    original, occluder = blobs(30, 30, 1)
    same = packed(np.repeat(original[None], 50, axis=0)), packed(np.repeat(occluder[None], 50, 0))
    found = sampled_quad_pixels(*same, 30, quads=1000, seed=0)
    assert len(np.unique(found[:, 0])) > 40
