"""Many triangles at once are drawn as one by one, and LLVM's instructions do what Python does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels import faces as module
from simplifier.kernels.compiled.kernel import inner_kernel
from simplifier.kernels.coverage import draw_views
from simplifier.kernels.faces import draw_eight, list_bare, list_pictured, project

ROOM = module._ROOM
SEEDS = st.integers(0, 2**32 - 1)
FLAT = np.eye(2, 4)
"""A view that takes x and y for pixel coordinates."""


@inner_kernel
def pictured_by_machine(cells, faces, begin, listed, count):
    return list_pictured(cells, faces, begin, listed, count)


@inner_kernel
def bare_by_machine(listed, begin, mask, most_rows, bare, count):
    return list_bare(listed, begin, mask, mask.shape[1], most_rows, bare, count)


@inner_kernel
def eight_by_machine(points, listed, begin, columns, mask):
    return draw_eight(points, listed, begin, columns, mask, mask.shape[1])


def picture(space, faces, rows, columns):
    """(rows, words) of what the faces cover; the pictures of views beside it stay as they are."""
    masks = np.zeros((3, rows, -(-columns // 64)), np.uint64)
    draw_views(space, faces, np.array([FLAT] * 3), columns, 1, 2, masks)
    assert not masks[[0, 2]].any()
    return masks[1]


def picture_one_by_one(space, faces, rows, columns):
    """The same of each face alone, which is drawn in the plain way."""
    masks = np.zeros((1, rows, -(-columns // 64)), np.uint64)
    for face in faces:
        corners = np.ascontiguousarray(space[:, face])
        draw_views(corners, np.arange(3, dtype=np.int32)[None], FLAT[None], columns, 0, 1, masks)
    return masks[0]


def empty_list():
    return np.full((6, ROOM), -1, np.int32)


def soup(rng, count, rows, columns, size, shared=0.0):
    """Vertices (3, n) of triangles of about that size, some of them beside the image, with corners
    at pixel centres and between them, a ``shared`` part of them those of others; and their faces
    (count, 3)."""
    middles = rng.uniform(-size, np.array([columns, rows]) + size, (count, 1, 2))
    corners = middles + rng.normal(0.0, size, (count, 3, 2))
    exact = rng.random((count, 3, 1)) < 0.3
    vertices = np.where(exact, np.floor(corners) + 0.5, corners).reshape(-1, 2)
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    others = rng.permutation(faces.reshape(-1)).reshape(-1, 3)
    return in_space(vertices), np.where(rng.random((count, 3)) < shared, others, faces)


def in_space(places):
    """(3, n) of places (n, 2) in the image."""
    return np.ascontiguousarray(np.pad(places, ((0, 0), (0, 1))).T)


def projected(space, rows, columns):
    """Points (n, 2) and cells (n,) of vertices (3, n)."""
    points, cells = np.empty((space.shape[1], 2)), np.empty(space.shape[1], np.uint32)
    project(space, FLAT, rows, columns, points, cells)
    return points, cells


@settings(max_examples=60, deadline=None)
@given(
    seed=SEEDS, count=st.integers(0, 300), rows=st.integers(1, 90), columns=st.integers(1, 200),
    size=st.sampled_from([0.4, 2.0, 6.0, 20.0, 70.0]),
)  # fmt: skip
def test_many_triangles_cover_what_each_alone_covers(seed, count, rows, columns, size):
    shown = *soup(np.random.default_rng(seed), count, rows, columns, size, 0.1), rows, columns
    assert np.array_equal(picture(*shown), picture_one_by_one(*shown))


def test_which_triangles_are_pictured_is_told_as_in_python():
    """Of cells next to each other, equal in one half or in both, and far apart."""
    rng = np.random.default_rng(8)
    cells = (rng.integers(0, 3, 500) << 16 | rng.integers(0, 3, 500)).astype(np.uint32)
    cells[::50] = rng.integers(0, 2**32, 10, np.uint32)
    faces = rng.integers(0, 500, (320, 3)).astype(np.int32)
    lengths = set()
    for begin in range(0, 257, 3):
        found, told = empty_list(), empty_list()
        count = int(pictured_by_machine(cells, faces, begin, found, begin % 16))
        assert count == list_pictured(cells, faces, begin, told, begin % 16)
        assert np.array_equal(found[:, :count], told[:, :count])
        lengths.add(count - begin % 16)
    assert len(lengths) > 8


@pytest.mark.parametrize("columns", [40, 64, 200])
def test_which_triangles_are_bare_is_told_as_in_python(columns):
    """Behind a picture with holes; large ones are told apart."""
    rng, kinds = np.random.default_rng(columns), set()
    for size in (1.0, 3.0, 8.0, 30.0):
        space, faces = soup(rng, 400, 50, columns, size)
        mask = picture_one_by_one(space, faces[:30], 50, columns)
        _, cells = projected(space, 50, columns)
        for begin in range(0, 320, 5):
            listed = empty_list()
            if list_pictured(cells, faces, begin, listed, 0) < 16:
                continue
            found, told = empty_list(), empty_list()
            result = int(bare_by_machine(listed, 0, mask, 16, found, 7))
            assert result == list_bare(listed, 0, mask, mask.shape[1], 16, told, 7)
            count = result & 0xFFFFFFFF
            assert np.array_equal(found[:, :count], told[:, :count])
            kinds.add((count > 7, count < 23, result >> 32 > 0))
    assert all(set(told) == {False, True} for told in zip(*kinds, strict=True))


@pytest.mark.parametrize("columns", [40, 64, 200])
def test_eight_triangles_are_drawn_as_in_python(columns):
    rng, drawn = np.random.default_rng(columns), 0
    for size in (1.0, 3.0, 6.0):
        space, faces = soup(rng, 400, 50, columns, size)
        points, cells = projected(space, 50, columns)
        for begin in range(0, 330, 7):
            listed, small = empty_list(), empty_list()
            words = -(-columns // 64)
            found, told = np.zeros((2, 52, words), np.uint64)
            if list_pictured(cells, faces, begin, listed, 0) < 16:
                continue
            few = list_bare(listed, 0, found[1:-1], words, 16, small, 0) & np.uint64(0xFFFFFFFF)
            if few < 8:
                continue
            beyond = eight_by_machine(points, small, int(few) - 8, columns, found[1:-1])
            assert beyond == draw_eight(points, small, int(few) - 8, columns, told[1:-1], words)
            assert np.array_equal(found, told)
            drawn += 1
    assert drawn > 50


def test_a_crossing_that_rounding_takes_out_of_its_window_is_told_and_drawn():
    """A corner is a hair right of column 31, so its box begins with column 32.  Its edges are long:
    their crossing beside it is rounded to column 31."""
    rng, columns, told = np.random.default_rng(5), 128, 0
    corners = np.column_stack([rng.uniform(66.0, 94.0, 192), rng.uniform(-60.0, -20.0, 192)])
    corners[::3, 0] = np.nextafter(31.5, 32.0)
    corners[::3, 1] = np.nextafter(9.5, 10.0)
    space = in_space(corners)
    points, cells = projected(space, 30, columns)
    faces = np.arange(192, dtype=np.int32).reshape(-1, 3)
    listed, found = empty_list(), np.zeros((30, 2), np.uint64)
    assert list_pictured(cells, faces, 0, listed, 0) == 64
    for begin in range(0, 64, 8):
        beyond = eight_by_machine(points, listed, begin, columns, found)
        assert beyond == draw_eight(points, listed, begin, columns, found, 2)
        told += int(beyond).bit_count()
    assert told > 0
    shown = space, faces, 30, columns
    assert np.array_equal(picture(*shown), picture_one_by_one(*shown))
