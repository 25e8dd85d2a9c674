"""A triangle keeps to voxels exactly when it touches none but those, and not the grid's border."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from simplifier.geometry.room import EVERYWHERE, Room
from simplifier.kernels import voxelize
from simplifier.kernels.soup_views import all_contained
from simplifier.kernels.voxelize import (
    is_contained,
    mark_all_triangles,
    mark_cells,
    mark_triangles,
)

SIZE, PARTS = 4, 8
NEAR, OFF = 5e-10, 1e-7  # voxels: less than what counts as touching, and more


def touched(triangle):
    """(SIZE,) * 3 bool: whether closed sets meet, by separating axes in whole numbers.

    ``triangle`` (3, 3) int, in parts of a voxel.
    """
    corners = np.asarray(triangle, dtype=np.int64)
    edges = corners[[1, 2, 0]] - corners
    units = np.eye(3, dtype=np.int64)
    axes = [*units, np.cross(edges[0], edges[1])]
    axes += [np.cross(edge, unit) for edge in edges for unit in units]
    low = np.indices((SIZE,) * 3).reshape(3, -1).T * PARTS
    meets = np.ones(len(low), dtype=bool)
    for axis in axes:
        ends = corners @ axis
        begin = low @ axis + PARTS * np.minimum(axis, 0).sum()
        end = low @ axis + PARTS * np.maximum(axis, 0).sum()
        meets &= (begin <= ends.max()) & (end >= ends.min())
    return meets.reshape((SIZE,) * 3)


def contained(triangle, voxels):
    """``triangle`` in voxels."""
    return is_contained(*(tuple(map(float, corner)) for corner in triangle), Room.of(voxels).voxels)


def kept_to(triangle, layers, limit, size):
    """As :func:`contained`, in cells of ``size`` voxels along each axis; ``triangle`` in voxels.

    There are cells on both sides of what is asked about.  Words of cells are asked for where they
    are not known yet and where they are.
    """
    layers, corners = np.pad(layers, 2 * size), tuple(map(tuple, triangle / size + 2.0))
    cells = len(layers) // size
    blocks = layers.reshape(cells, size, cells, size, cells, size)
    least, most = blocks.min(axis=(1, 3, 5)), blocks.max(axis=(1, 3, 5))
    if size != 4:
        nothing = np.zeros((0, 0, 0), np.uint64)
        return is_contained(*corners, (layers, least, most, limit, nothing, EVERYWHERE))
    bits = (blocks > limit).transpose(0, 2, 4, 1, 3, 5).reshape(cells, cells, cells, 64)
    known = np.packbits(bits, axis=-1, bitorder="little").view("<u8")[..., 0].astype(np.uint64)
    found = np.zeros_like(known)
    kept = is_contained(*corners, (layers, least, most, limit, found, EVERYWHERE))
    assert np.array_equal(found[found > 0], known[found > 0])
    assert is_contained(*corners, (layers, least, most, limit, known, EVERYWHERE)) == kept
    return kept


def marked(triangles, before=None):
    """``before``: what is marked already."""
    found = np.zeros((SIZE,) * 3, dtype=np.bool_) if before is None else before.copy()
    faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    points = np.ascontiguousarray(np.reshape(triangles, (-1, 3)), dtype=np.float64)
    mark_triangles(points, faces, np.zeros(3), 1.0, 0, len(faces), found)
    return found


def triangles(least, most):
    place = st.tuples(*[st.integers(least, most)] * 3)
    return st.tuples(place, place, place)


inner = triangles(1, SIZE * PARTS - 1)
anywhere = triangles(-2, SIZE * PARTS + 2)
on_corners = triangles(0, SIZE).map(lambda t: tuple(tuple(PARTS * x for x in p) for p in t))


@settings(max_examples=80)
@given(inner)
@example(((8, 8, 8), (24, 8, 8), (8, 24, 8)))  # in the faces between voxels
@example(((1, 1, 1), (31, 31, 31), (16, 16, 16)))  # a segment through corners
@example(((9, 9, 9), (10, 9, 11), (9, 12, 9)))  # within a voxel
@example(((9, 9, 1), (10, 9, 31), (9, 12, 17)))  # within a row
@example(((9, 8, 1), (9, 8, 31), (9, 8, 17)))  # along the face between two rows
@example(((6, 6, 9), (13, 6, 9), (6, 13, 10)))  # within a layer, and smaller than a voxel's face
def test_every_voxel_that_it_touches_is_asked_for_and_no_other(corners):
    triangle, expected = np.array(corners) / PARTS, touched(corners)
    assert np.array_equal(marked([triangle]), expected)
    assert contained(triangle, expected)
    for voxel in np.argwhere(expected):
        missing = np.ones((SIZE,) * 3, dtype=np.bool_)
        missing[tuple(voxel)] = False
        assert not contained(triangle, missing)
        assert marked([triangle], before=missing).all()


@given(st.integers(0, 2**32 - 1), st.tuples(*[st.integers(1, 3)] * 3), st.integers(1, 5))
def test_a_cell_is_touched_where_one_of_its_voxels_is(seed, shape, size):
    voxels = np.random.default_rng(seed).random([size * n for n in shape]) < 0.5 / size**3
    blocks = voxels.reshape(shape[0], size, shape[1], size, shape[2], size).any(axis=(1, 3, 5))
    found = np.ones((2, *shape), dtype=np.bool_)
    mark_cells(voxels, 0, shape[0], found[0])
    assert np.array_equal(found[0], blocks)
    for row in range(shape[0]):  # other rows stay as they are
        before = found[1].copy()
        mark_cells(voxels, row, row + 1, found[1])
        before[row] = blocks[row]
        assert np.array_equal(found[1], before)


@pytest.mark.parametrize("threads", ["1", "2"])
@pytest.mark.parametrize("count", [1, 30])
def test_all_triangles_are_marked_by_any_number_of_threads(count, threads, monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    monkeypatch.setattr(voxelize, "_LEAST_WORK", 40)
    points = np.random.default_rng(count).uniform(0.0, SIZE, (3 * count, 3))
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    found = np.zeros((SIZE,) * 3, dtype=np.bool_)
    mark_all_triangles(points, faces, np.zeros(3), 1.0, found)
    assert np.array_equal(found, marked(points.reshape(-1, 3, 3)))


@settings(max_examples=40)
@given(inner)
@example(((9, 9, 1), (10, 9, 31), (9, 12, 17)))  # within a row
@example(((1, 9, 9), (31, 10, 9), (17, 9, 12)))
@example(((9, 1, 9), (9, 31, 10), (12, 17, 9)))
@example(((9, 9, 10), (22, 9, 11), (9, 23, 12)))  # within a layer
@example(((9, 9, 10), (11, 9, 22), (12, 9, 23)))
@example(((9, 9, 10), (11, 22, 9), (12, 9, 23)))
def test_voxels_of_a_cell_are_asked_for_one_by_one(corners):
    """All voxels at the limit that it touches do, and one of them above does not."""
    triangle, expected, limit = np.array(corners) / PARTS, touched(corners), 3
    for size in (1, 2, 4):
        assert kept_to(triangle, np.where(expected, limit, 9).astype(np.uint8), limit, size)
        for voxel in np.argwhere(expected):
            layers = np.where(expected, limit, 0).astype(np.uint8)
            layers[tuple(voxel)] = limit + 1
            assert not kept_to(triangle, layers, limit, size)


@settings(max_examples=80)
@given(anywhere | on_corners)
@example(((0, 8, 8), (16, 9, 8), (8, 16, 9)))
@example(((9, 9, 32), (16, 9, 8), (8, 16, 9)))
def test_a_grid_is_as_good_as_one_with_a_layer_of_nothing_around_it(corners):
    triangle = np.array(corners) / PARTS
    full = np.ones((SIZE,) * 3, dtype=np.bool_)
    assert contained(triangle, full) == contained(triangle + 1.0, np.pad(full, 1))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("place", [0, SIZE * PARTS])
def test_what_lies_in_the_border_touches_the_outer_voxels(axis, place):
    flat = np.array([[3, 5, 9], [21, 11, 4], [7, 27, 30]])
    flat[:, axis] = place
    assert np.array_equal(marked([flat / PARTS]), touched(flat))


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
@pytest.mark.parametrize("short", [1e-12, 1e-35])
def test_a_side_without_length_says_nothing_and_the_others_say_all(axes, short):
    """Its direction is noise, and its corners are as good as one."""
    for ends in (((1, 0, 1), (0, 0, 0)), ((1, 1, 1), (0, 0, 0)), ((3, 1, 2), (1, 2, 0))):
        triangle = np.array([*ends, ends[1]], dtype=np.float64)
        triangle[2, 2 if short < 1e-30 else 1] += short
        segment = np.array([*ends, ends[1]])[:, axes] * PARTS
        assert np.array_equal(marked([triangle[:, axes]]), touched(segment))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("corner", range(3))
def test_what_touches_the_border_leaves_the_grid(axis, corner):
    full = np.ones((3, 4, 5), dtype=np.bool_)
    inside = np.array([[1.2, 1.4, 1.3], [1.7, 1.1, 2.6], [1.5, 2.3, 1.9]])
    assert contained(inside, full)
    end = full.shape[axis]
    for place, expected in (
        (-9.0, False), (-OFF, False), (0.0, False), (NEAR, False), (OFF, True), (end - OFF, True),
        (end - NEAR, False), (end, False), (end + OFF, False), (end + 9.0, False),
    ):  # fmt: skip
        moved = inside.copy()
        moved[corner, axis] = place
        assert contained(moved, full) == expected


@settings(max_examples=60)
@given(inner | on_corners, st.integers(0, 2**32 - 1))
def test_rounding_makes_no_voxel_untouched(corners, seed):
    """Corners that lie on a face of a voxel are moved off it by less than counts."""
    expected = touched(corners)
    shift = np.random.default_rng(seed).choice([-0.1 * NEAR, 0.0, 0.1 * NEAR], 3)
    moved = np.clip(np.array(corners) / PARTS + shift, 0.0, SIZE)
    assert np.array_equal(marked([moved]), expected)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_within_rounding_of_a_face_is_on_both_sides_and_further_off_is_not(axis, side):
    flat = np.array([[1.3, 1.2, 1.4], [2.6, 1.7, 1.5], [1.6, 2.7, 2.4]])
    for off, both in ((NEAR, True), (OFF, False)):
        flat[:, axis] = 2.0 + side * off
        layers = marked([flat]).any(axis=tuple(k for k in range(3) if k != axis))
        assert layers.sum() == (2 if both else 1)
        assert layers[2 if side > 0.0 else 1]


@settings(max_examples=40)
@given(st.lists(inner, min_size=1, max_size=5), st.integers(0, 2**32 - 1))
def test_each_triangle_of_a_soup_is_judged_alone(soup, seed):
    rng = np.random.default_rng(seed)
    voxels = rng.random((SIZE,) * 3) < 0.97
    inside = rng.random(len(soup)) < 0.5
    all_contained(np.array(soup) / PARTS, Room.of(voxels).voxels, inside)
    assert inside.tolist() == [not (touched(one) & ~voxels).any() for one in soup]


@settings(max_examples=40)
@given(st.lists(inner, min_size=3, max_size=3), st.sampled_from([0.5, 1.0, 4.0]))
def test_marks_are_those_of_the_faces_asked_for_where_the_grid_lies(soup, scale):
    origin = np.array([5.0, -7.0, 11.0])
    found = np.zeros((SIZE,) * 3, dtype=np.bool_)
    points = (np.array(soup) / PARTS).reshape(-1, 3) / scale + origin
    faces = np.arange(9, dtype=np.int32).reshape(3, 3)[::-1]
    mark_triangles(
        np.ascontiguousarray(points), np.ascontiguousarray(faces), origin, scale, 0, 2, found
    )
    assert np.array_equal(found, touched(soup[2]) | touched(soup[1]))


@settings(max_examples=80)
@given(inner | anywhere, st.sampled_from([1, 2, 4]), st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_in_cells_of_several_voxels_each_voxel_is_judged(corners, size, seed, limit):
    """Cells of one layer are judged at once, those of several by their voxels: the same comes out.

    The whole is looked at, too, as voxels that are cells themselves.
    """
    rng = np.random.default_rng(seed)
    cells = rng.integers(0, 5, (SIZE,) * 3).repeat(size, 0).repeat(size, 1).repeat(size, 2)
    mixed = rng.random((SIZE,) * 3).repeat(size, 0).repeat(size, 1).repeat(size, 2) < 0.5
    layers = np.where(mixed, rng.integers(0, 3, cells.shape), cells).astype(np.uint8)
    blocks = layers.reshape(SIZE, size, SIZE, size, SIZE, size)
    least, most = blocks.min(axis=(1, 3, 5)), blocks.max(axis=(1, 3, 5))
    triangle = np.array(corners) / PARTS
    expected = contained(triangle * size, layers <= limit)
    barred = np.zeros(least.shape if size == 4 else (0, 0, 0), np.uint64)
    room = (layers, least, most, limit, barred, EVERYWHERE)
    for _ in range(2):  # cells have been looked at then
        assert is_contained(*(tuple(map(float, corner)) for corner in triangle), room) == expected
    if size == 4:
        by_cell = (layers > limit).reshape(SIZE, 4, SIZE, 4, SIZE, 4).transpose(0, 2, 4, 1, 3, 5)
        words = np.packbits(by_cell.reshape(-1, 64), axis=1, bitorder="little").view("<u8")
        looked_at = barred != 0
        assert np.array_equal(barred[looked_at], words.reshape(barred.shape)[looked_at])
