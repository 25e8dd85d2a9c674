"""Heights as codes: none that hides is higher, none that may be seen is lower."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import scene_of_boxes
from simplifier.kernels.cull_map import TILE
from simplifier.visibility.cull_maps.coded_field import CodedField, Codes, pixels_of
from simplifier.visibility.cull_maps.erosion import Window, shrunk
from tests.visibility.solid.test_height_field import field_of

WINDOWS = (Window.box(3, 1), Window.box(1, 4), Window.sector(3, 8, 5.0), Window.sector(1, 8, 5.0))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_occluder_is_higher_and_no_top_lower(seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 6))
    low = np.column_stack([random.uniform(0.0, 300.0, (count, 2)), np.zeros(count)])
    size = np.column_stack([random.uniform(5.0, 90.0, (count, 2)), 900 * random.random(count)])
    boxes = np.stack([low, low + size + 0.01], axis=1)
    field = field_of(scene_of_boxes(boxes, [*"abcdef"[:count]]))
    coded = CodedField(field)
    codes, (nx, ny) = coded.codes, field.shape
    assert codes.step <= 0.02
    for window in WINDOWS:
        solid = coded.erosion(window)
        assert solid.flags.c_contiguous
        found, expected = pixels_of(solid, (0, 0), (nx, ny)), shrunk(field.inner, window)
        assert np.array_equal(found > 0, np.isfinite(expected))
        there = found > 0
        assert (codes.solid(found)[there] <= expected[there]).all()
        assert (found[there] > codes.place(expected[there].astype(np.float64)) - 1.0).all()
        assert (codes.solid(found)[~there] == -np.inf).all()
    inside = solid.astype(np.int64).sum()
    assert inside == found.astype(np.int64).sum()  # and nothing beyond the raster
    tops = pixels_of(coded.pixels[4], (0, 0), (nx, ny))
    exact = np.maximum(field.tops, field.inner)
    assert np.array_equal(tops > 0, np.isfinite(exact))
    places = codes.place(exact.astype(np.float64))[tops > 0]
    assert ((tops[tops > 0] >= places) & (tops[tops > 0] < places + 1.0)).all()
    assert (coded.object_codes >= codes.place(field.object_tops.astype(np.float64))).all()
    for x in range(0, nx, 4):
        for y in range(0, ny, 4):
            assert coded.blocks[x // 4, y // 4] == tops[x : x + 4, y : y + 4].max()
    check_pyramid(coded)


def check_pyramid(coded):
    """Each tile has the highest object of its pixels."""
    levels, sizes = coded.pyramid
    highest = coded.codes.up(coded.field.tops)
    assert sizes[0, 3] == TILE
    for begin, along_x, along_y, size in sizes.tolist():
        for tile in range(along_x * along_y):
            x, y = size * (tile // along_y), size * (tile % along_y)
            assert levels[begin + tile] == highest[x : x + size, y : y + size].max()
    assert max(sizes[-1, 1:3]) <= 8


def test_codes_of_a_flat_scene_tell_eyes_from_it():
    plate = np.array([[(0.0, 0.0, 0.0), (9.0, 9.0, 4.0)]])
    codes = Codes.of(field_of(scene_of_boxes(plate, ["plate"])))
    heights = np.array([4.0, -np.inf], dtype=np.float32)
    assert codes.up(heights).tolist() == codes.down(heights).tolist() == [1, 0]
    assert codes.place(4.5) > 3.0 > codes.place(3.5)


def test_heights_out_of_range_are_the_ends_of_it():
    codes = Codes(10.0, 0.5)
    heights = np.array([9.4, 9.5, 10.2, 1e9, np.inf], dtype=np.float32)
    assert codes.down(heights).tolist() == [0, 0, 1, 65535, 65535]
    assert codes.up(heights).tolist()[:3] == [0, 0, 2]
    assert codes.heights(np.array([1.0, 3.0, -np.inf])).tolist() == [10.0, 11.0, -np.inf]


def test_pixels_are_cut_out_of_squares_anywhere():
    coded = CodedField(field_of(scene_of_boxes(np.array([[(0, 0, 0), (9, 30, 4.0)]]), ["a"])))
    solid = coded.erosion(Window.box(1, 1))
    whole = pixels_of(solid, (0, 0), coded.field.shape)
    assert np.array_equal(pixels_of(solid, (3, 5), (9, 21)), whole[3:9, 5:21])
    assert whole.any()
    assert coded.erosion(Window.box(1, 1)) is solid
