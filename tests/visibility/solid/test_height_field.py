"""Heights of pixels: solid all over wherever they say so, however objects touch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import generated_city, scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.visibility.solid.height_field import height_field
from tests.solids import box, joined, torus


def upright(scene):
    """In the scene's own coordinates, z up."""
    return UprightScene(scene, np.arange(3, dtype=np.int32), np.zeros(3), scene.bounds())


def field_of(scene, cell=1.0, ground=False):
    plans = scene.bounds()[:, :, :2]
    around = np.array([plans[:, 0].min(axis=0), plans[:, 1].max(axis=0)])
    return height_field(upright(scene), cell, around, ground)


def scene(*meshes):
    count = len(meshes)
    names = tuple(f"object {index}" for index in range(count))
    numbers = np.arange(count, dtype=np.int32)
    return Scene(tuple(meshes), names, numbers, np.tile(np.eye(4), (count, 1, 1)))


def boxes(*corners):
    return scene_of_boxes(
        np.array(corners, dtype=np.float64), [f"{i}" for i in range(len(corners))]
    )


def at(field, x, y):
    """The height of the pixel at a place."""
    i, j = np.floor((np.array([x, y]) - field.low) / field.cell).astype(int)
    return field.inner[i, j]


def test_a_box_fills_the_pixels_that_it_covers_and_no_other():
    field = field_of(boxes([(0.5, 0.0, 0.0), (4.5, 3.0, 7.0)]))
    solid = np.argwhere(field.inner == 7.0) * field.cell + field.low
    assert np.array_equal(np.unique(solid[:, 0]), [1.0, 2.0, 3.0])
    # Walls on the border of a pixel touch it: the solid's own border hides nothing by itself.
    assert np.array_equal(np.unique(solid[:, 1]), [1.0])
    assert (field.inner[field.inner != 7.0] == -np.inf).all()
    assert field.tops.max() == 7.0
    assert field.lost == 0.0


@pytest.mark.parametrize("cell", [0.1, 0.2, 0.3, 0.7])
def test_a_corner_that_rounding_moves_over_the_border_of_the_field(cell):
    for steps in range(1, 60):
        low = -50.0 * steps * cell
        field = field_of(boxes([(low, low, 0.0), (low + 6.0, low + 6.0, 4.0)]), cell)
        assert at(field, low + 3.0, low + 3.0) == 4.0


def test_touching_boxes_lose_nothing_at_the_wall_between_them():
    low, high = ((0.0, 0.0, 0.0), (5.3, 9.0, 4.0)), ((5.3, 0.0, 0.0), (11.0, 9.0, 9.0))
    field = field_of(boxes(low, high))
    assert at(field, 4.5, 4.5) == 4.0
    assert at(field, 5.5, 4.5) == 4.0  # the wall passes here: as high as the lower of them
    assert at(field, 6.5, 4.5) == 9.0


@pytest.mark.parametrize("width", [1e-6, 1e-3, 0.5])
def test_a_gap_is_a_gap_however_narrow(width):
    field = field_of(
        boxes([(0.0, 0, 0), (5.3, 9.0, 4.0)], [(5.3 + width, 0.0, 0), (11.0, 9.0, 4.0)])
    )
    assert at(field, 5.5, 4.5) == -np.inf


def test_walls_of_other_lengths_that_touch_are_closed_as_well():
    field = field_of(
        boxes(
            [(0.0, 0, 0), (5.5, 9.0, 4.0)], [(5.5, 0.0, 0), (11.0, 4.5, 5.0)],
            [(5.5, 4.5, 0), (11.0, 9.0, 6.0)],
        )
    )  # fmt: skip
    assert at(field, 5.5, 4.5) == 4.0
    assert at(field, 8.5, 4.5) == 5.0


def test_a_box_within_another_lowers_nothing():
    field = field_of(boxes([(0.0, 0, 0), (9.0, 9, 4)], [(3.5, 3.5, 0), (6.5, 6.5, 20)]))
    assert at(field, 5.5, 5.5) == 20.0
    assert at(field, 3.5, 5.5) == 4.0  # the tower's wall


def test_a_roof_counts_where_it_is_lowest_in_the_pixel():
    house = joined(box((8.0, 8.0, 2.0)))
    vertices = np.array(house.vertices)
    vertices[(vertices[:, 2] > 0) & (vertices[:, 0] > 4), 2] = 10.0  # rises by 1 a unit of x
    field = field_of(scene(TriangleMesh.from_soup(vertices, house.faces)))
    assert at(field, 3.5, 3.5) == pytest.approx(5.0)
    assert at(field, 6.5, 3.5) == pytest.approx(8.0)
    assert at(field, 3.5, 3.5) <= 5.0
    i, j = np.floor(np.array([3.5, 3.5]) - field.low).astype(int)
    place = i * field.shape[1] + j
    assert field.object_tops[field.starts[place] : field.starts[place + 1]] >= 6.0


def test_what_is_over_a_gap_hides_nothing():
    table = joined(box((9.0, 9.0, 1.0), low=(0.0, 0.0, 5.0)))
    assert np.isinf(field_of(scene(table, box((1, 1, 1), low=(20, 0, 0)))).inner).all()
    arch = torus()  # lies down: its hole is no solid, its tube stands on a line alone
    assert np.isinf(field_of(scene(arch), 0.25).inner).all()


def test_an_open_base_is_closed_by_the_ground():
    house = box((9.0, 9.0, 5.0), without=(4,))
    assert at(field_of(scene(house)), 4.5, 4.5) == 5.0
    uphill = box((9.0, 9.0, 5.0), low=(20.0, 0.0, 3.0), without=(4,))
    both = scene(house, uphill)
    assert at(field_of(both), 24.5, 4.5) == -np.inf  # one may look under it
    assert at(field_of(both, ground=True), 24.5, 4.5) == 8.0
    assert field_of(both).lost == pytest.approx(0.5, abs=0.02)


def test_open_sheets_and_roofs_without_walls_hide_nothing():
    canopy = box((9.0, 9.0, 5.0), without=(0, 1, 2, 3, 4))
    walls = box((9.0, 9.0, 5.0), without=(0, 4))
    for mesh in (canopy, walls):
        assert np.isinf(field_of(scene(mesh), ground=True).inner).all()


def test_either_winding_is_right():
    mesh = box((9.0, 9.0, 5.0))
    turned = TriangleMesh.from_soup(mesh.vertices, np.array(mesh.faces)[:, ::-1])
    assert np.array_equal(field_of(scene(mesh)).inner, field_of(scene(turned)).inner)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_turned_boxes_are_solid_wherever_a_pixel_says_so(seed):
    random = np.random.default_rng(seed)
    meshes = []
    for _ in range(4):
        angle, (w, d, h) = random.uniform(0.0, np.pi), random.uniform(1.0, 9.0, 3)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        vertices = np.array(box((w, d, h)).vertices)
        vertices[:, :2] = vertices[:, :2] @ turn.T + random.uniform(0.0, 9.0, 2)
        meshes.append(
            (TriangleMesh.from_soup(vertices, box().faces), turn, vertices[0, :2], (w, d, h))
        )
    field = field_of(scene(*(one[0] for one in meshes)))
    places = np.argwhere(np.isfinite(field.inner))
    some = places[random.integers(len(places), size=200)] if len(places) else places
    points = (some + random.random((len(some), 2))) * field.cell + field.low
    heights = field.inner[tuple(some.T)]
    least = np.full(len(points), -np.inf)
    for _, turn, corner, (w, d, h) in meshes:
        own = (points - corner) @ turn
        within = (own >= -1e-9).all(axis=1) & (own <= np.array([w, d]) + 1e-9).all(axis=1)
        least = np.where(within, np.maximum(least, h), least)
    assert (heights <= least).all()


def test_all_pixels_that_an_object_touches_list_it():
    city = generated_city(2, seed=3)
    field = field_of(city, 0.75)
    bounds = city.bounds()
    for index in range(len(city)):
        (x0, y0), (x1, y1) = np.floor((bounds[index, :, :2] - field.low) / field.cell).astype(int)
        for x in (x0, x1):
            for y in range(y0, y1 + 1):
                place = slice(*field.starts[x * field.shape[1] + y : x * field.shape[1] + y + 2])
                where = np.flatnonzero(field.objects[place] == index)
                assert len(where) == 1
                assert field.object_tops[place][where[0]] >= bounds[index, 1, 2]
