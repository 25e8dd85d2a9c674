"""Written scenes: valid glTF by what its specification asks for, and the same when read again."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.errors import OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from tests.solids import blob, box, sphere


def scene_of(meshes, mesh_of, linear, offsets):
    transforms = np.tile(np.eye(4), (len(mesh_of), 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = linear, offsets
    names = tuple(f"object {i}" for i in range(len(mesh_of)))
    return Scene(tuple(meshes), names, np.array(mesh_of, dtype=np.int32), transforms)


def document(path):
    data = path.read_bytes()
    assert data[:4] == b"glTF"
    assert int.from_bytes(data[8:12], "little") == len(data)
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + length])


def corners(scene, index):
    mesh = scene.joined([index])
    return mesh.vertices[mesh.faces]


def test_float32_meshes_come_back_to_the_last_bit(tmp_path):
    turns = np.array([np.eye(3), [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], np.diag([-2.0, 3.0, 0.1])])
    scene = scene_of([box((2, 3, 4)), box((1, 1, 8))], [1, 0, 1], turns, [[1, 2, 3]] * 3)
    write_scene(scene, tmp_path / "scene.glb")
    back = load_scene(tmp_path / "scene.glb")
    assert back.names == scene.names
    assert back.warnings == ()
    assert back.mesh_of.tolist() == scene.mesh_of.tolist()
    assert back.transforms.tobytes() == scene.transforms.tobytes()
    for ours, theirs in zip(back.meshes, scene.meshes, strict=True):
        np.testing.assert_array_equal(ours.vertices[ours.faces], theirs.vertices[theirs.faces])


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e3, 5e6]))
def test_any_transforms_come_back_to_float32(tmp_path_factory, seed, offset):
    """With shear and mirrors, and meshes in map coordinates."""
    generator = np.random.default_rng(seed)
    mesh = blob(rings=4)
    meshes = [TriangleMesh.from_soup(mesh.vertices + offset, mesh.faces), sphere(rings=3)]
    count = 6
    linear, offsets = generator.normal(size=(count, 3, 3)), generator.uniform(-99, 99, (count, 3))
    scene = scene_of(meshes, generator.integers(0, 2, count).tolist(), linear, offsets)
    path = tmp_path_factory.mktemp("scene") / "scene.glb"
    write_scene(scene, path)
    back = load_scene(path)
    assert back.names == scene.names
    for index in range(count):
        ours, theirs = corners(back, index), corners(scene, index)
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-6 + 1e-14 * np.abs(theirs).max())


def test_a_mesh_is_stored_once_and_every_node_is_free_of_shear(tmp_path):
    generator = np.random.default_rng(1)
    linear = np.concatenate([np.tile(np.eye(3), (50, 1, 1)), generator.normal(size=(10, 3, 3))])
    scene = scene_of([sphere(rings=8)], [0] * 60, linear, generator.normal(size=(60, 3)))
    path = tmp_path / "scene.glb"
    write_scene(scene, path)
    root = document(path)
    assert len(root["meshes"]) == 1
    assert len(root["nodes"]) == 70
    assert len(root["scenes"][0]["nodes"]) == 60
    for node in root["nodes"]:
        axes = np.array(node["matrix"]).reshape(4, 4)[:3, :3]
        unit = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        np.testing.assert_allclose(unit @ unit.T, np.eye(3), atol=1e-9)


def test_accessors_keep_within_their_views_and_state_their_bounds(tmp_path):
    scene = scene_of([box(), sphere(rings=3)], [0, 1], np.tile(np.eye(3), (2, 1, 1)), 0.0)
    path = tmp_path / "scene.glb"
    write_scene(scene, path)
    root = document(path)
    for accessor in root["accessors"]:
        view = root["bufferViews"][accessor["bufferView"]]
        size = 12 if accessor["type"] == "VEC3" else 4
        assert accessor["byteOffset"] % 4 == 0
        assert accessor["byteOffset"] + size * accessor["count"] <= view["byteLength"]
    assert root["accessors"][0]["min"] == [0.0, 0.0, 0.0]
    assert root["accessors"][0]["max"] == [1.0, 1.0, 1.0]
    assert (
        sum(view["byteLength"] for view in root["bufferViews"]) == root["buffers"][0]["byteLength"]
    )


def test_another_reader_finds_the_same_triangles(tmp_path):
    generator = np.random.default_rng(2)
    linear = generator.normal(size=(5, 3, 3))
    scene = scene_of(
        [box(), sphere(rings=3)], [0, 1, 0, 1, 1], linear, generator.normal(size=(5, 3))
    )
    path = tmp_path / "scene.glb"
    write_scene(scene, path)
    theirs = trimesh.load(path, process=False, force="mesh")
    assert len(theirs.faces) == scene.triangle_counts.sum()
    boxes = scene.bounds()
    np.testing.assert_allclose(
        theirs.bounds, [boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)], atol=1e-6
    )


def test_names_of_any_letters(tmp_path):
    scene = Scene((box(),), ("Straße „7“\n\x00",), np.zeros(1, np.int32), np.eye(4)[None])
    write_scene(scene, tmp_path / "scene.glb")
    assert load_scene(tmp_path / "scene.glb").names == scene.names


def test_what_cannot_be_written(tmp_path):
    scene = scene_of([box()], [0], np.eye(3)[None], 0.0)
    with pytest.raises(OutputError, match=r"scenes cannot be written as '\.obj'; use \.glb"):
        write_scene(scene, tmp_path / "scene.obj")
    with pytest.raises(OutputError, match="there is no folder"):
        write_scene(scene, tmp_path / "absent" / "scene.glb")
    huge = scene_of([box((1e60, 1, 1))], [0], np.eye(3)[None], 0.0)
    with pytest.raises(OutputError, match=r"huge\.glb: a coordinate is too large"):
        write_scene(huge, tmp_path / "huge.glb")
    with pytest.raises(OutputError, match="no object"):
        write_scene(scene_of([box()], [], np.eye(3), 0.0), tmp_path / "empty.glb")
    assert list(tmp_path.iterdir()) == []
