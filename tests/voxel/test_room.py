"""The room: its layers against distances by scipy, its sides against flood fill, its bound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.room import INTERIOR, NEVER, SURFACE, WHOLE
from simplifier.options.stages import ERROR_VOXELS, SolidOptions
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify
from simplifier.voxel.room import make_room
from simplifier.voxel.voxelize import voxelize
from tests.solids import box, joined, random_soup, sphere, torus

SHAPES = {
    "ball": sphere(1.0, rings=12),
    "torus": torus(),
    "boxes": joined(box((1.0, 2.0, 0.5)), box((0.7, 0.7, 0.7), (1.6, 0.3, 0.1))),
}


def room_of(mesh, resolution=12, size=4):
    solid = solidify(mesh, SolidOptions(resolution=resolution), Stopwatch())
    return solid, make_room(mesh, solid, size)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("size", [2, 3, 4])
def test_what_was_marked_before_the_solid_makes_the_same_room(name, size):
    solid, room = room_of(SHAPES[name], 12, size)
    known = solidify(SHAPES[name], SolidOptions(resolution=12), Stopwatch(), size=size)
    assert np.array_equal(known.filled.inside, solid.filled.inside)
    assert known.finer.shape == tuple(size * length for length in solid.filled.shape)
    nothing = TriangleMesh.from_soup(np.eye(3), [[0, 1, 2]])  # no triangle is marked any more
    assert np.array_equal(make_room(nothing, known, size).layers, room.layers)


def finely_touched(mesh, solid, room):
    """The voxels of the room that the surface touches, by the voxelizer of a whole grid."""
    size, margin = room.layers.shape[0] // room.shape[0], int(room.margin)
    touched = voxelize(mesh, size * max(solid.touched.shape))
    shift = (touched.origin - solid.touched.origin) / touched.cell_size
    if np.abs(shift - np.rint(shift)).max() > 1e-9:
        return None  # grids of another phase
    low = np.rint(shift).astype(int) + margin * size
    placed = np.zeros(room.layers.shape, dtype=np.bool_)
    ends = [slice(a, a + n) for a, n in zip(low, touched.shape, strict=True)]
    placed[tuple(ends)] = touched.inside
    return placed


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("size", [1, 2, 4, 5])
def test_of_a_closed_mesh_the_inside_is_what_no_path_reaches(name, size):
    solid, room = room_of(SHAPES[name], 12, size)
    surface = room.layers == SURFACE
    labels, _ = ndimage.label(~surface)
    outside = labels == labels[0, 0, 0]
    inner = room.layers == INTERIOR
    # A cell that is no surface is as the solid has it, which closes niches that are hardly seen.
    cells = np.pad(solid.filled.inside & ~solid.touched.inside, int(room.margin))
    known = cells.repeat(size, 0).repeat(size, 1).repeat(size, 2)
    near = np.pad(solid.touched.inside, int(room.margin))
    near = near.repeat(size, 0).repeat(size, 1).repeat(size, 2)
    assert np.array_equal(inner[~near], known[~near])
    assert not (inner & outside & near & ~ndimage.binary_dilation(known, iterations=9)).any()
    assert (inner | surface | outside).all()


@pytest.mark.parametrize("name", SHAPES)
def test_the_surface_is_what_the_voxelizer_marks(name):
    solid, room = room_of(SHAPES[name], 16, 4)
    expected = finely_touched(SHAPES[name], solid, room)
    if expected is not None:
        assert np.array_equal(room.layers == SURFACE, expected)
    assert (room.layers == SURFACE).any()


@pytest.mark.parametrize("size", [1, 2, 3, 4, 8])
def test_layers_are_as_far_off_as_they_say_and_take_in_all_that_is_nearer(size):
    _, room = room_of(SHAPES["torus"], 10, size)
    away = ndimage.distance_transform_edt(room.layers > SURFACE) / size
    for layer in range(SURFACE + 1, len(room.reaches)):
        furthest = away[room.layers == layer].max()
        # From centre to centre; a point of the one voxel and one of the other add a diagonal.
        assert furthest + np.sqrt(3.0) / size <= room.reaches[layer] + 1e-9
        nearer = away[(room.layers > layer) & (room.layers != NEVER)]
        assert nearer.size == 0 or nearer.min() > away[room.layers == layer].min()
    assert len(room.reaches) - 1 == room.limit
    assert room.bound <= ERROR_VOXELS + 1e-9


def test_cells_hold_the_lowest_and_the_highest_layer_and_the_share_inside():
    _, room = room_of(SHAPES["boxes"], 9, 4)
    nx, ny, nz = room.shape
    blocks = room.layers.reshape(nx, 4, ny, 4, nz, 4)
    assert np.array_equal(room.least, blocks.min(axis=(1, 3, 5)))
    assert np.array_equal(room.most, blocks.max(axis=(1, 3, 5)))
    halves = np.where(blocks == INTERIOR, 1.0, np.where(blocks == SURFACE, 0.5, 0.0))
    assert np.abs(room.shares / WHOLE - halves.mean(axis=(1, 3, 5))).max() < 1.0 / 127.0


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 8))
def test_any_soup(seed, count, size):
    """Every voxel has a side, nothing beside the grid is in the room, threads change nothing."""
    mesh = random_soup(seed, count, 0.3)
    solid, room = room_of(mesh, 9, size)
    assert set(np.unique(room.layers)) <= {*range(len(room.reaches)), NEVER}
    border = np.ones(room.shape, dtype=np.bool_)
    border[1:-1, 1:-1, 1:-1] = False
    assert not room.cells[border].any()
    touched = np.pad(solid.touched.inside, int(room.margin))
    assert ((room.least <= SURFACE) >= touched).all()


def test_an_open_box_is_full_and_its_rim_is_shared_between_the_sides():
    """What viewers hardly see is inside; by the opening the two sides meet."""
    mesh = box(without=[5])
    solid, room = room_of(mesh, 16, 4)
    assert solid.closed_by[0].by == "sight"
    assert (room.layers == INTERIOR).sum() > 0.4 * 64**3
    low = int(room.margin) * 4
    assert (room.layers[:, :, : low - 8] > SURFACE).all()


@pytest.mark.parametrize("name", SHAPES)
def test_what_keeps_wholly_inside_has_no_layers_around(name):
    """Its voxels are those that no path reaches from outside, in the fine grid itself."""
    mesh = SHAPES[name]
    solid = solidify(mesh, SolidOptions(resolution=12, conservative=True), Stopwatch())
    room = make_room(mesh, solid, 4)
    free = room.layers != SURFACE
    parts, _ = ndimage.label(free)
    reached = free & (parts == parts[0, 0, 0])
    np.testing.assert_array_equal(room.layers == NEVER, reached)
    assert set(np.unique(room.layers)) <= {INTERIOR, SURFACE, NEVER}
    assert room.limit == INTERIOR
