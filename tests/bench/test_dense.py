"""The dense city and what hides in it, on a handful of boxes in place of buildings."""

from __future__ import annotations

import numpy as np
import pytest

from bench import dense
from bench.dense_city import SHAKE, central, dense_city, scattered, subdivided, welded
from simplifier.geometry.camera import Camera
from tests.hierarchy.scenes import moved, scene_of
from tests.solids import box, joined


def row_of_houses(count=6):
    """Houses 10 units apart along x, the first one twice as wide and high as the others."""
    house = box((4.0, 4.0, 6.0), (-2.0, -2.0, 0.0))
    places = [moved(10.0 * index) for index in range(count)]
    places[0] = moved(linear=np.diag([2.0, 2.0, 2.0]))
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
    source = row_of_houses()
    city = dense_city(source, central(source, 3), least=100)
    assert len(city) == 3
    assert (city.triangle_counts == 192).all()
    again, other = (dense_city(source, central(source, 3), least=100, seed=seed) for seed in (0, 1))
    assert np.array_equal(city.meshes[2].vertices, again.meshes[2].vertices)
    assert not np.array_equal(city.meshes[2].vertices, other.meshes[2].vertices)
    still = welded(source.meshes[0])
    while len(still.faces) < 100:
        still = subdivided(still)
    off = np.abs(city.meshes[0].vertices - still.vertices)
    assert 0.5 * SHAKE < off.max() <= SHAKE


def test_which_buildings_are_chosen():
    source = row_of_houses()
    assert central(source, 2).tolist() == [2, 3]
    assert len(set(scattered(source, 5).tolist())) == 5
    assert scattered(source, 3).tolist() == scattered(source, 3).tolist()


def test_rows_of_a_tiny_city(tmp_path):
    source = row_of_houses()
    city = dense_city(source, np.arange(6), least=60)
    few = {"budget": 8, "resolution": 12, "moves": 60}
    rows = {row["method"]: row for row in dense.dense_rows("row", city, tmp_path / "a", 3, **few)}
    assert [name.split(",")[0] for name in rows] == [
        "all triangles", "meshoptimizer", "inner box", "near occluders of the scene",
    ]  # fmt: skip
    whole, box_row = rows["all triangles"], rows["inner box"]
    assert whole["triangles"] == city.triangle_counts.sum()
    assert box_row["triangles"] == 12 * len(city)
    assert len({row["hidden"] for row in rows.values() if "hidden" in row}) == 1
    assert box_row["wrong_pixels"] == 0
    assert (tmp_path / "a" / "scene.json").exists()


def test_the_truth_judges_what_hides_and_what_does_not():
    """A wall before a house hides it, and one as wide as all that is seen hides it wrongly."""
    wall = box((20.0, 1.0, 20.0), (-10.0, 0.0, 0.0))
    house = box((2.0, 2.0, 2.0), (-1.0, 0.0, 0.0))
    scene = scene_of([wall, house], [0, 1, 1], [moved(), moved(y=20.0), moved(-30.0, 20.0)])
    eye = np.array([0.0, -20.0, 1.7])
    ahead, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    camera = Camera.looking(eye, ahead, up, 60.0, 0.1)
    truths = [dense.truth(scene, camera)]
    found = dense.judged(scene, truths, dense.all_triangles(scene))
    assert (found["hidden"], found["recall"], found["wrong_pixels"]) == (1, 1.0, 0)
    none = (np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))
    assert dense.judged(scene, truths, none)["recall"] == 0.0
    wide = box((200.0, 1.0, 200.0), (-100.0, -10.0, -50.0))
    wrong = dense.judged(scene, truths, (wide.vertices, wide.faces))
    assert (wrong["recall"], wrong["wrong_objects"]) == (1.0, 2)
    assert wrong["wrong_share"] == pytest.approx(1.0)
