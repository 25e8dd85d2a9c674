"""The dense city and what hides in it, on a handful of boxes in place of buildings."""

from __future__ import annotations

import numpy as np
import pytest

from bench.dense import all_triangles, dense_rows, judged, truth
from bench.dense_city import SHAKE, dense, some_buildings, subdivided, welded
from simplifier.camera_paths.generate import generate_path
from simplifier.geometry.camera import Camera
from simplifier.options.scene import PathOptions
from tests.hierarchy.scenes import moved, scene_of
from tests.solids import box, joined


def two_rows_of_houses(count=12):
    """Houses 9 units apart, the first one twice as wide and high as the others."""
    house = box((6.0, 6.0, 6.0), (-3.0, -3.0, 0.0))
    places = [moved(9.0 * (index // 2), 9.0 * (index % 2)) for index in range(count)]
    places[0] = moved(-9.0, linear=np.diag([2.0, 2.0, 2.0]))
    return scene_of([house], [0] * count, places)


def area(mesh):
    corners = mesh.vertices[mesh.faces]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(sides, axis=1).sum()


def test_subdividing_keeps_the_surface_and_what_is_shared():
    mesh = welded(joined(box(), box((1.0, 1.0, 1.0), (1.0, 0.0, 0.0))))
    finer = subdivided(mesh)
    assert len(finer.faces) == 4 * len(mesh.faces)
    assert area(finer) == pytest.approx(area(mesh))
    assert len(np.unique(finer.vertices, axis=0)) == len(finer.vertices)


def test_a_city_is_as_dense_as_asked_for_and_the_same_for_a_seed():
    source = two_rows_of_houses()
    city, again, other = (dense(source, least=100, seed=seed) for seed in (0, 0, 1))
    assert (city.triangle_counts == 192).all()
    assert np.array_equal(city.meshes[0].vertices, again.meshes[0].vertices)
    assert not np.array_equal(city.meshes[0].vertices, other.meshes[0].vertices)
    still = welded(source.meshes[0])
    while len(still.faces) < 100:
        still = subdivided(still)
    off = np.abs(city.meshes[0].vertices - still.vertices)
    assert 0.5 * SHAKE < off.max() <= SHAKE


def test_which_buildings_are_chosen():
    source = two_rows_of_houses()
    some = some_buildings(source, 5)
    assert len(some) == len(some.meshes) == len(set(some.names)) == 5
    assert set(some.names) < set(source.names)
    assert some.names == some_buildings(source, 5).names
    assert some.names != some_buildings(source, 5, seed=1).names


def test_rows_of_a_tiny_city():
    source = two_rows_of_houses()
    city, path = dense(source, least=60), generate_path(source, PathOptions("street", 5, "z"))
    rows = {row["method"]: row for row in dense_rows(city, path, 8, resolution=12, moves=60)}
    few = [row for row in rows.values() if "recall" in row]
    assert len(rows) == 5
    assert rows["all triangles"]["triangles"] == city.triangle_counts.sum()
    assert rows["inner box"]["triangles"] == 12 * len(city)
    assert rows["inner box"]["wrong_pixels"] == 0
    assert len({row["hidden"] for row in few}) == 1
    near, inside = rows["near occluders"], rows["near occluders, --overhang 0"]
    assert near["triangles"] > 0
    assert near["recall"] >= inside["recall"]


def test_the_truth_judges_what_hides_and_what_does_not():
    """A wall before a house hides it, and one as wide as all that is seen hides it wrongly."""
    wall = box((20.0, 1.0, 20.0), (-10.0, 0.0, 0.0))
    house = box((2.0, 2.0, 2.0), (-1.0, 0.0, 0.0))
    scene = scene_of([wall, house], [0, 1, 1], [moved(), moved(y=20.0), moved(-30.0, 20.0)])
    eye = np.array([0.0, -20.0, 1.7])
    ahead, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    camera = Camera.looking(eye, ahead, up, 60.0, 0.1)
    truths = [truth(scene, camera)]
    found = judged(scene, truths, all_triangles(scene))
    assert (found["hidden"], found["recall"], found["wrong_pixels"]) == (1, 1.0, 0)
    none = (np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))
    assert judged(scene, truths, none)["recall"] == 0.0
    wide = box((200.0, 1.0, 200.0), (-100.0, -10.0, -50.0))
    wrong = judged(scene, truths, (wide.vertices, wide.faces))
    assert (wrong["recall"], wrong["wrong_objects"]) == (1.0, 2)
    assert wrong["wrong_share"] == pytest.approx(1.0)
