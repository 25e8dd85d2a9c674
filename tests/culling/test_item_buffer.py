"""Scenes of instances: the same picture however they are put together."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling import item_buffer
from simplifier.culling.item_buffer import ItemBuffer, Part
from simplifier.errors import OptionError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from tests.rasters import looking_ahead, random_camera

ROWS, COLUMNS = 45, 60


def instances(rng, count=12):
    """Spheres and boxes about the camera, turned, stretched and some mirrored."""
    meshes = [
        TriangleMesh.from_soup(mesh.vertices + shift, mesh.faces)
        for mesh, shift in ((trimesh.creation.icosphere(2), 3.0), (trimesh.creation.box(), -9.0))
    ]
    transforms = np.tile(np.eye(4), (count, 1, 1))
    transforms[:, :3, :3] = rng.normal(size=(count, 3, 3))
    transforms[:, :3, 3] = rng.normal(size=(count, 3)) * 8.0
    names = tuple(f"object {index}" for index in range(count))
    return Scene(tuple(meshes), names, rng.integers(0, 2, count).astype(np.int32), transforms)


def drawn(scene, camera, objects=None):
    buffer = ItemBuffer(ROWS, COLUMNS)
    buffer.draw(scene, camera, objects)
    return buffer


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_instances_are_drawn_as_their_triangles_in_the_world(seed):
    rng = np.random.default_rng(seed)
    scene, camera = instances(rng), random_camera(rng)
    buffer = drawn(scene, camera)
    joined = scene.joined(range(len(scene)))
    items = np.repeat(np.arange(len(scene), dtype=np.int32), scene.triangle_counts)
    whole = ItemBuffer(ROWS, COLUMNS)
    whole.draw_parts([Part(joined, np.eye(4), items)], camera)
    # Points come by another order of products, so a centre on an edge may fall to the other side.
    assert np.count_nonzero(buffer.items != whole.items) <= 2
    assert np.abs(buffer.fragments - whole.fragments).max() <= 4
    assert (buffer.items >= 0).any() == (whole.items >= 0).any()


def test_some_objects_alone_and_one_after_the_other():
    rng = np.random.default_rng(3)
    scene, camera = instances(rng, 20), looking_ahead()
    whole = drawn(scene, camera)
    some = drawn(scene, camera, [4, 2, 9])
    assert set(np.unique(some.items)) <= {-1, 2, 4, 9}
    assert len(some.visible) == len(some.fragments) == len(scene)
    assert (some.fragments[[2, 4, 9]] == whole.fragments[[2, 4, 9]]).all()
    for index in range(len(scene)):
        if index not in (4, 2, 9):
            some.draw(scene, camera, [index])
    assert (some.items == whole.items).all()
    some.clear()
    assert (some.items == -1).all()
    assert len(some.fragments) == 0
    assert whole.visible.sum() == np.count_nonzero(whole.items >= 0) > 100


def test_same_picture_on_any_number_of_threads(monkeypatch):
    scene, camera = instances(np.random.default_rng(5), 30), looking_ahead()
    monkeypatch.setattr(item_buffer, "_WORTH_A_THREAD", 100)
    pictures = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        pictures.append(drawn(scene, camera))
    for other in pictures[1:]:
        assert (other.items == pictures[0].items).all()
        assert (other.depth == pictures[0].depth).all()
        assert (other.fragments == pictures[0].fragments).all()


def test_parts_of_a_mesh_make_up_the_whole():
    sphere = trimesh.creation.icosphere(3)
    mesh = TriangleMesh.from_soup(sphere.vertices + np.array([0.0, 0.0, 3.0]), sphere.faces)
    camera = looking_ahead()
    whole, parts = ItemBuffer(ROWS, COLUMNS), ItemBuffer(ROWS, COLUMNS)
    whole.draw_parts([Part(mesh, np.eye(4), 0)], camera)
    parts.draw_parts([Part(mesh, np.eye(4), 1, 500), Part(mesh, np.eye(4), 0, 0, 500)], camera)
    assert (parts.depth == whole.depth).all()
    assert parts.fragments.sum() == whole.fragments.sum() > 0
    assert set(np.unique(parts.items)) == {-1, 0, 1}


def test_in_map_coordinates_the_picture_is_the_same():
    rng = np.random.default_rng(8)
    scene, far = instances(rng), np.array([1.8e6, 5.4e6, 320.0])
    moved = scene.transforms.copy()
    moved[:, :3, 3] += far
    there = Scene(scene.meshes, scene.names, scene.mesh_of, moved)
    near_by, far_out = drawn(scene, looking_ahead()), drawn(there, looking_ahead(far))
    assert np.count_nonzero(near_by.items != far_out.items) <= 2


def test_nothing_and_impossible_screens():
    scene = instances(np.random.default_rng(1))
    assert (drawn(scene, looking_ahead(), []).items == -1).all()
    buffer = ItemBuffer(ROWS, COLUMNS)
    buffer.draw_parts([], looking_ahead())
    assert len(buffer.visible) == 0
    for rows, columns in ((0, 5), (5, 0), (5, 20_000)):
        with pytest.raises(OptionError, match=r"^(rows|columns): .* out of range"):
            ItemBuffer(rows, columns)
