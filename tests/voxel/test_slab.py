"""The slab of a mesh: its planes bound all of it, touch it, and lie along its flat sides."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.room import EVERYWHERE
from simplifier.options.stages import SolidOptions, make_options
from simplifier.progress import Stopwatch
from simplifier.steps.room import open_room
from simplifier.steps.solid import solidify
from simplifier.voxel import slab as module
from simplifier.voxel.slab import thin_slab
from tests.solids import as_soup, box, flower, joined, moved, random_soup, rubble, sphere, turned

TURNS = {"as it is": np.eye(3), "turned": Rotation.random(random_state=3).as_matrix()}


def grid_of(mesh, resolution=64):
    return solidify(mesh, SolidOptions(resolution=resolution), Stopwatch()).core


def along(mesh, grid, slab, margin):
    return (grid.to_grid(mesh.vertices) + margin) @ slab[:3]


def check_slab(mesh, grid, slab, margin=2.0):
    """Its normal has length 1, and its planes are the first and the last to touch the mesh."""
    assert np.linalg.norm(slab[:3]) == pytest.approx(1.0)
    places = along(mesh, grid, slab, margin)
    assert (places.min(), places.max()) == pytest.approx(tuple(slab[3:]), abs=1e-9)


@pytest.mark.parametrize("turn", TURNS)
def test_a_flat_mesh_lies_in_a_plane(turn):
    mesh = turned(flower(), TURNS[turn])
    grid = grid_of(mesh)
    slab = thin_slab(mesh, grid, 2.0)
    check_slab(mesh, grid, slab)
    assert slab[4] - slab[3] < 1e-4
    assert abs(slab[:3] @ TURNS[turn][:, 2]) == pytest.approx(1.0, abs=1e-10)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("thick", [0.01, 0.1])
def test_a_plate_lies_between_its_sides_whatever_its_edges_are(turn, thick):
    plate = joined(box((2.0, 1.0, thick)), box((0.3, 0.2, thick), (1.9, 0.7, 0.0)))
    mesh = turned(plate, TURNS[turn])
    grid = grid_of(mesh)
    slab = thin_slab(mesh, grid, 2.0)
    check_slab(mesh, grid, slab)
    assert slab[4] - slab[3] == pytest.approx(thick / grid.cell_size, abs=1e-4)


@pytest.mark.parametrize("mesh", [sphere(), box((1.0, 0.8, 0.6)), random_soup(4, 90, 0.4)])
def test_what_is_thick_has_none(mesh):
    assert thin_slab(mesh, grid_of(mesh), 2.0) is EVERYWHERE


def test_a_part_that_stands_up_counts_however_small_it_is(monkeypatch):
    """The faces that tell the direction need not show it."""
    monkeypatch.setattr(module, "_FACES", 8)
    mesh = joined(flower(), box((0.01, 0.01, 0.9), (0.3, 0.3, 0.0)))
    few = mesh.faces[:: -(-len(mesh.faces) // 8)]
    assert np.ptp(mesh.vertices[few][..., 2]) == 0.0
    assert thin_slab(mesh, grid_of(mesh), 2.0) is EVERYWHERE


def test_it_is_the_same_in_blocks(monkeypatch):
    mesh = turned(flower(), TURNS["turned"])
    grid = grid_of(mesh)
    whole = thin_slab(mesh, grid, 2.0)
    monkeypatch.setattr(module, "_BLOCK", 7)
    assert thin_slab(mesh, grid, 2.0) == pytest.approx(whole, abs=1e-12)


@pytest.mark.parametrize(("scale", "offset"), [(1e-60, 0.0), (1e60, 0.0), (1.0, 1e6)])
def test_it_is_that_of_any_unit_and_of_maps(scale, offset):
    plate = turned(box((2.0, 1.0, 0.05)), TURNS["turned"])
    here, there = (
        thin_slab(one, grid_of(one), 2.0) for one in (plate, moved(plate, scale, offset))
    )
    assert there == pytest.approx(here, abs=1e-3)


def test_the_room_of_a_plate_has_its_slab():
    plate = box((2.0, 1.0, 0.05))
    options = make_options(2.0)
    solid = solidify(plate, options.solid, Stopwatch())
    room = open_room(plate, solid, options)
    check_slab(plate, solid.core, room.slab, room.margin)
    assert room.up_to(1).slab is room.slab


def ground(size=100.0):
    """Two triangles in the xz plane."""
    return box((size, 0.0, size), without=(0, 1, 2, 4, 5))


def heap(count, height, seed):
    """Of rubble in the middle of the ground, as high as that."""
    low, high = (45.0, 0.0, 45.0), (55.0, 0.9 * height, 55.0)
    triangles = rubble(count, low, high, 0.1 * height, seed=seed)
    triangles[0, :, 1] = 0.0, height, 0.5 * height
    return as_soup(triangles)


def heaps(count, height):
    """The ground is neither among the first triangles nor among the last."""
    return joined(heap(count, height, seed=2), ground(), heap(count, height, seed=1))


@pytest.mark.parametrize("count", [1601, 20_001])
def test_few_faces_that_are_most_of_the_surface_tell_the_direction(count):
    mesh, height = heaps(count, 6.0), 6.0
    grid = grid_of(mesh)
    few = mesh.faces[:: -(-len(mesh.faces) // 1024)]
    assert np.ptp(mesh.vertices[few][..., 0]) < 20.0  # not one of the ground
    slab = thin_slab(mesh, grid, 2.0)
    check_slab(mesh, grid, slab)
    assert np.abs(slab[:3]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-2)
    assert slab[4] - slab[3] == pytest.approx(height / grid.cell_size, rel=0.2)


@pytest.mark.parametrize(("height", "left_out"), [(1.0, True), (2.0, True), (4.0, False)])
@pytest.mark.parametrize("upside_down", [False, True])
def test_what_a_ground_carries_is_left_out_where_no_voxel_shows_it(height, left_out, upside_down):
    """It is higher than a diagonal of a cell from 2.7 on."""
    mesh = heaps(30, height)
    if upside_down:
        mesh = TriangleMesh(mesh.vertices * [1.0, -1.0, 1.0], mesh.faces)
    grid = grid_of(mesh)
    slab = thin_slab(mesh, grid, 2.0)
    if not left_out:
        check_slab(mesh, grid, slab)
        return
    assert np.abs(slab[:3]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-5)
    assert along(ground(), grid, slab, 2.0) == pytest.approx(slab[3], abs=1e-2)
    assert slab[4] - slab[3] < 1e-2


def test_what_is_more_than_a_hundredth_of_the_surface_is_not_left_out():
    mesh = joined(ground(), box((20.0, 1.0, 20.0), (40.0, 0.0, 40.0)))
    grid = grid_of(mesh)
    check_slab(mesh, grid, thin_slab(mesh, grid, 2.0))
