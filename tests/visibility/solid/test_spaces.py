"""Runs, spaces and touched voxels, beside dense arrays of the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.scene import Scene
from simplifier.kernels.viewer_fill import draw_spaces, stack_solid, thicken, walk
from simplifier.kernels.voxelize import mark_triangles
from simplifier.visibility.solid.spaces import Spaces, voxels_of
from tests.solids import box, random_soup

CORNERS = np.ones((3, 3, 3), dtype=bool)


def packed(touched):
    """Dense (nx, ny, nz) bool as columns of bits."""
    nx, ny, nz = touched.shape
    octets = np.zeros((nx, ny, 8 * -(-nz // 64)), dtype=np.uint8)
    some = np.packbits(touched, axis=2, bitorder="little")
    octets[:, :, : some.shape[2]] = some
    return octets.view("<u8").astype(np.uint64)


def unpacked(bits, depth):
    octets = bits.astype("<u8").view(np.uint8)
    return np.unpackbits(octets, axis=2, bitorder="little", count=depth).astype(bool)


def grid(seed, depth=70):
    """Random touched voxels, clumped, and earth; dense, with nothing free on the border."""
    random = np.random.default_rng(seed)
    shape = (*random.integers(3, 9, 2), depth)
    noise = ndimage.uniform_filter(random.random(shape), 3)
    touched = noise > np.quantile(noise, random.uniform(0.3, 0.7))
    earth = random.integers(0, 3, shape[:2]).astype(np.int32)
    free = ~touched & (np.arange(depth) >= earth[:, :, None])
    free[[0, -1]] = free[:, [0, -1]] = False
    return touched, earth, free


def dense(spaces, depth):
    """The number of each voxel's space, -1 where none is."""
    numbers = np.full((*spaces.shape, depth), -1)
    for space in range(len(spaces)):
        drawn = np.zeros(numbers.shape, dtype=bool)
        wanted = np.arange(len(spaces)) == space
        draw_spaces(*spaces.runs, spaces.shape[1], np.zeros(3, np.int64), wanted, drawn)
        numbers[drawn] = space
    return numbers


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_spaces_are_what_a_dense_flood_finds(seed):
    touched, earth, free = grid(seed)
    spaces = Spaces.of(packed(touched), earth, touched.shape[2])
    numbers = dense(spaces, touched.shape[2])
    labels, count = ndimage.label(free, structure=CORNERS)
    assert count == len(spaces)
    assert np.array_equal(numbers >= 0, free)
    pairs = np.unique(np.stack([labels[free], numbers[free]]), axis=1)
    assert pairs.shape[1] == count
    for space in range(count):
        places = np.argwhere(numbers == space)
        assert len(places) == spaces.volumes[space]
        assert np.array_equal(spaces.boxes[space], [places.min(axis=0), places.max(axis=0)])
        assert spaces.tips[space].tolist() in places[places[:, 2] == places[:, 2].max()].tolist()
        assert spaces.at(spaces.tips[space]) == space
    x, y, z = np.argwhere(~free)[0]
    assert spaces.at(np.array([x, y, z])) == -1


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_windows_meet_the_spaces_in_them(seed):
    touched, earth, _ = grid(seed)
    spaces = Spaces.of(packed(touched), earth, touched.shape[2])
    numbers = dense(spaces, touched.shape[2])
    random = np.random.default_rng(seed)
    ends = np.sort(random.integers(0, touched.shape, (50, 2, 3)), axis=1)
    cells, found = spaces.touched(np.ascontiguousarray(ends), ground=False)
    got = {(cell, space) for cell, space in zip(cells.tolist(), found.tolist(), strict=True)}
    assert len(got) == len(cells)
    wanted = set()
    for cell, (low, high) in enumerate(ends.tolist()):
        window = numbers[tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))]
        wanted |= {(cell, int(space)) for space in np.unique(window) if space >= 0}
    assert got == wanted


def test_what_is_below_the_first_surface_in_a_window_is_below_the_ground():
    touched = np.zeros((3, 3, 10), dtype=bool)
    touched[1, 1, 4] = True
    spaces = Spaces.of(packed(touched), np.zeros((3, 3), np.int32), 10)
    windows = np.array([[[1, 1, 0], [1, 1, 6]], [[1, 1, 0], [1, 1, 3]], [[1, 1, 5], [1, 1, 6]]])
    below, above = spaces.at(np.array([1, 1, 0])), spaces.at(np.array([1, 1, 9]))
    cells, found = spaces.touched(windows, ground=True)
    # The second ends below the surface: who stands there has a roof, not the ground, overhead.
    assert sorted(zip(cells.tolist(), found.tolist(), strict=True)) == [
        (0, above), (1, below), (2, above)
    ]  # fmt: skip


def stacked(touched, earth, numbers, shut, sheets):
    """Plainly: up each column as long as voxels are earth, shut, or between shut ones."""
    nx, ny, nz = touched.shape
    reached = np.zeros((nx, ny), dtype=np.int32)
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                if z < earth[x, y]:
                    solid = True
                elif numbers[x, y, z] >= 0:
                    solid = shut[numbers[x, y, z]]
                else:
                    around = (slice(max(i - 1, 0), i + 2) for i in (x, y, z))
                    beside = numbers[tuple(around)]
                    kinds = {bool(shut[space]) for space in beside[beside >= 0]}
                    solid = sheets and kinds == {True}
                if not solid:
                    break
                reached[x, y] = z + 1
    return reached


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_columns_are_solid_up_to_the_first_gap(seed, sheets):
    touched, earth, _ = grid(seed, 20)
    spaces = Spaces.of(packed(touched), earth, 20)
    shut = np.random.default_rng(seed).random(len(spaces)) < 0.7
    reached = np.empty(spaces.shape, dtype=np.int32)
    stack_solid(*spaces.runs, shut, earth, 20, sheets, reached)
    assert np.array_equal(reached, stacked(touched, earth, dense(spaces, 20), shut, sheets))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_thickened_is_all_that_shares_a_corner(seed):
    touched, _, _ = grid(seed, 150)
    bits = packed(touched)
    thick = np.empty_like(bits)
    thicken(bits, thick)
    assert np.array_equal(unpacked(thick, 150), ndimage.binary_dilation(touched, CORNERS))


def test_steps_are_counted_around_corners():
    free = np.ones((5, 5, 1), dtype=bool)
    free[2, :4] = False
    distance = np.full(free.shape, -1, dtype=np.int32)
    distance[0, 0, 0] = 0
    walk(free, distance)
    assert distance[4, 0, 0] == 8
    assert distance[2, 0, 0] == -1


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_touched_voxels_are_those_of_the_other_voxelizer(seed):
    mesh = random_soup(seed, 20, 0.3)
    upright = UprightScene.of(Scene.of(mesh), "z")
    cell, shape = 0.15, (40, 40)
    low = np.array([-1.0, -1.0, 0.0])
    top = float(upright.extent[2])
    voxels = voxels_of(upright, low, cell, shape, top, None)
    plain = np.zeros((*shape, voxels.depth), dtype=bool)
    for vertices, faces in upright.triangles(np.full(3, -np.inf), np.full(3, np.inf)):
        mark_triangles(vertices, faces, voxels.origin, 1 / cell, 0, len(faces), plain)
    inside = np.zeros(shape, dtype=bool)
    inside[1:-1, 1:-1] = True
    assert np.array_equal(unpacked(voxels.bits, voxels.depth)[inside], plain[inside])


CORNER = np.array([-1.0, -1.0, 0.0])


def test_what_lies_in_the_lowest_plane_touches_nothing():
    upright = UprightScene.of(Scene.of(box((4.0, 4.0, 3.0))), "z")
    voxels = voxels_of(upright, CORNER, 0.5, (13, 13), 3.0, None)
    touched = unpacked(voxels.bits, voxels.depth)
    assert not touched[6, 6, :-1].any()
    assert touched[6, 6, -1]
    assert touched[2, 6].all()


def test_ground_is_below_walls_that_stand_on_it():
    scene = Scene.of(box((4.0, 4.0, 3.0), (0.0, 0.0, 0.0), without=(4,)))
    upright = UprightScene.of(scene, "z")
    boxes = upright.boxes + np.array([0.0, 0.0, 2.0])
    boxes[0, 0, 2] = 0.0
    origin = upright.origin - np.array([0.0, 0.0, 2.0])
    low = UprightScene(upright.scene, upright.order, origin, boxes)
    earth = voxels_of(low, CORNER, 0.5, (13, 13), 5.0, 1.7).earth
    assert earth[2, 6] == 4
    assert earth[6, 6] == 0  # a roof stands on nothing
    assert not voxels_of(low, CORNER, 0.5, (13, 13), 5.0, None).earth.any()


def test_more_voxels_than_there_is_room_for_are_refused_with_the_epsilon_that_fits():
    upright = UprightScene.of(Scene.of(box((9.0, 9.0, 3000.0))), "z")
    with pytest.raises(OptionError, match="2 times as large"):
        voxels_of(upright, np.zeros(3), 0.1, (1000, 1000), 3000.0, None)
