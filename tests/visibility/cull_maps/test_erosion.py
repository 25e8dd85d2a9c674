"""Windows hold all that a piece of edge and a pixel reach, and hardly more; heights are shrunk."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.visibility.cull_maps.erosion import Window, sector_of, sectors, shrunk

HALVES = [0.3, 1.0, 2.0, 5.0, 7.4, 14.0]


def exact(index, count, half):
    """(k, k) the pixels that the hull of pieces and the square meets, by polygons."""
    turns = np.pi / count * (index + np.linspace(-0.5, 0.5, 400))
    ends = half * np.column_stack([np.cos(turns), np.sin(turns)])
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    hull = shapely.convex_hull(shapely.multipoints(np.concatenate([ends, -ends, square])))
    reach = max(int(np.ceil(half)), 1)
    steps = np.arange(-reach - 1, reach + 2)
    i, j = np.meshgrid(steps, steps, indexing="ij")
    boxes = shapely.box(i - 1.0, j - 1.0, i + 1.0, j + 1.0)
    return shapely.area(shapely.intersection(boxes, hull)) > 1e-6


def mask_of(window):
    """(2 rx + 1, 2 ry + 1) bool, with the middle at (rx, ry)."""
    reach = max(last for _, last in window.runs)
    lines = np.zeros((len(window.runs), 2 * reach + 1), dtype=bool)
    for line, (first, last) in zip(lines, window.runs, strict=True):
        line[reach + first : reach + last + 1] = True
    return lines.T if window.axis == 0 else lines


def on_all(window, reach):
    """The mask of a window with its middle at (reach, reach)."""
    mask = mask_of(window)
    wide = [(reach - size // 2,) * 2 for size in mask.shape]
    return np.pad(mask, wide)


@pytest.mark.parametrize("half", HALVES)
def test_windows_of_sectors_are_those_of_exact_hulls(half):
    count = sectors(half)
    for index in range(count):
        expected = exact(index, count, half)
        mask = on_all(Window.sector(index, count, half), len(expected) // 2)
        assert not (expected & ~mask).any()
        # Half-planes at some angles leave a corner more.
        assert mask.sum() <= 1.05 * expected.sum() + 4
        assert np.array_equal(mask, mask[::-1, ::-1])


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from(HALVES), st.floats(0.0, 1.0), st.floats(0.0, 2 * np.pi),
    st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_no_point_that_a_line_moves_to_is_outside_of_the_window(half, share, turn, seed):
    """The theorem, point by point: (1 - t) x + t y, from anywhere in the middle pixel."""
    random = np.random.default_rng(seed)
    piece = half * share * np.array([np.cos(turn), np.sin(turn)])
    window = Window.sector(sector_of(piece, sectors(half)), sectors(half), half)
    t, along = random.random((2, 2000, 1))
    places = random.random((2000, 2)) + (1 - t) * (2 * along - 1) * piece
    places += t * random.uniform(-1.0, 1.0, (2000, 2))
    mask = mask_of(window)
    x, y = np.floor(places).astype(int).T + np.array(mask.shape)[:, None] // 2
    assert mask[x, y].all()


def test_five_pixels_along_an_axis_need_the_box_of_squares():
    assert sectors(5.0) == 8
    assert Window.sector(0, 8, 5.0) == Window.box(5, 1)
    assert Window.sector(4, 8, 5.0) == Window.box(1, 5)
    for index in range(8):
        turned = mask_of(Window.sector((index + 4) % 8, 8, 5.0))
        assert np.array_equal(mask_of(Window.sector(index, 8, 5.0)), turned.T[:, ::-1])


def test_directions_are_sorted_into_the_nearest_sector():
    turns = np.radians([0.0, 11.0, -11.0, 12.0, 90.0, 180.0, 169.0, 168.0, -90.0])
    found = [sector_of(np.array([np.cos(turn), np.sin(turn)]), 8) for turn in turns]
    assert found == [0, 0, 0, 1, 4, 0, 0, 7, 4]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([*HALVES[:-1]]), st.integers(0, 100))
def test_heights_are_the_lowest_in_the_window(seed, half, index):
    random = np.random.default_rng(seed)
    heights = random.random(tuple(random.integers(1, 40, 2))).astype(np.float32)
    heights[random.random(heights.shape) < 0.1] = -np.inf
    window = Window.sector(index % sectors(half), sectors(half), half)
    expected = ndimage.minimum_filter(
        heights, footprint=mask_of(window), mode="constant", cval=-np.inf
    )
    assert np.array_equal(shrunk(heights, window), expected)
    box = Window.box(index % 4, index % 3)
    assert mask_of(box).shape == (2 * (index % 4) + 1, 2 * (index % 3) + 1)
    expected = ndimage.minimum_filter(heights, mask_of(box).shape, mode="constant", cval=-np.inf)
    assert np.array_equal(shrunk(heights, box), expected)
