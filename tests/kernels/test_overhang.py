"""What sticks out, against scipy's dilation and distances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.coverage import coverage_masks
from simplifier.kernels.overhang import count_beside, count_overhang, weigh_each, widen
from tests.pictures import sphere_projections


def packed(masks):
    """(V, rows, columns) bool to bit rows."""
    views, rows, columns = masks.shape
    words = -(-columns // 64)
    padded = np.zeros((views, rows, 64 * words), dtype=np.bool_)
    padded[:, :, :columns] = masks
    return np.packbits(padded, axis=2, bitorder="little").view("<u8").astype(np.uint64)


def counted(original, hidden):
    pixels, farthest = np.zeros((len(original), 2), np.int64), np.zeros(len(original), np.int64)
    count_overhang(
        packed(original), packed(hidden), original.shape[2], 0, len(original), pixels, farthest
    )
    return pixels, farthest


def plainly_counted(original, hidden):
    pixels, farthest = [], []
    for one, other in zip(original, hidden, strict=True):
        near = ndimage.binary_dilation(one, np.ones((3, 3)))
        over = other & ~near
        pixels.append((one.sum(), over.sum()))
        if not over.any():
            farthest.append(0)
        elif not one.any():
            farthest.append(-1)
        else:
            away = ndimage.distance_transform_edt(~one)
            farthest.append(round(float(away[over].max()) ** 2))
    return np.array(pixels), np.array(farthest)


@given(
    st.integers(1, 40), st.integers(1, 150), st.floats(0.0, 0.3), st.floats(0.0, 0.5),
    st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_random_masks(rows, columns, density, other_density, seed):
    generator = np.random.default_rng(seed)
    original = generator.random((2, rows, columns)) < density
    hidden = generator.random((2, rows, columns)) < other_density
    pixels, farthest = counted(original, hidden)
    wanted, furthest = plainly_counted(original, hidden)
    assert np.array_equal(pixels, wanted)
    assert np.array_equal(farthest, furthest)


@pytest.mark.parametrize(("beside", "over"), [(0, 0), (1, 0), (2, 1), (5, 4), (70, 69)])
def test_one_pixel_beside_is_no_overhang(beside, over):
    original = np.zeros((1, 30, 200), dtype=np.bool_)
    original[0, 10:20, 50:64] = True
    hidden = original.copy()
    hidden[0, 15, 64 : 64 + beside] = True
    pixels, farthest = counted(original, hidden)
    assert pixels.tolist() == [[140, over]]
    assert farthest.tolist() == [beside**2 if over else 0]


def test_across_a_corner_one_pixel_is_none_and_two_are():
    original = np.zeros((2, 9, 9), dtype=np.bool_)
    original[:, 4, 4] = True
    hidden = np.zeros_like(original)
    hidden[0, 5, 5] = hidden[1, 6, 6] = True
    pixels, farthest = counted(original, hidden)
    assert pixels.tolist() == [[1, 0], [1, 1]]
    assert farthest.tolist() == [0, 8]


@given(
    st.integers(1, 40), st.integers(1, 150), st.floats(0.0, 0.3), st.floats(0.0, 0.5),
    st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_pixels_beside_wide_masks(rows, columns, density, other_density, seed):
    generator = np.random.default_rng(seed)
    original = packed(generator.random((2, rows, columns)) < density)
    hidden = packed(generator.random((2, rows, columns)) < other_density)
    wide, (there, beside) = np.zeros_like(original), np.zeros((2, 2), np.int64)
    widen(original, 0, 2, wide, there)
    count_beside(wide, hidden, 0, 2, beside)
    counted, farthest = np.zeros((2, 2), np.int64), np.zeros(2, np.int64)
    count_overhang(original, hidden, columns, 0, 2, counted, farthest)
    assert np.array_equal(np.stack([there, beside], axis=1), counted)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.02, 0.3, 2.0]))
def test_each_triangle_is_weighed_as_its_own_silhouette_is(seed, size):
    """Small, large, and past the edges of a picture."""
    generator = np.random.default_rng(seed)
    soup = generator.uniform(-1.0, 1.0, (6, 1, 3)) + size * generator.normal(size=(6, 3, 3))
    projections = 2.0 * sphere_projections(image_axes(hemisphere_directions(4)), np.zeros(3), 1.0)
    wide = generator.integers(0, 2**64, (4, 128, 2), dtype=np.uint64)
    weights = generator.random(4)
    found = np.full((6, 2), np.nan)
    weigh_each(
        np.ascontiguousarray(soup.transpose(0, 2, 1)), projections, wide, weights, 0, 6, found
    )
    for triangle, (beside, within) in zip(soup, found, strict=True):
        face = np.arange(3, dtype=np.int32)[None]
        shown = coverage_masks(triangle, face, projections, 128, 128)
        ones = [np.bitwise_count(one).sum(axis=(1, 2)) for one in (shown & ~wide, shown & wide)]
        assert np.allclose([beside, within], [weights @ one for one in ones])
