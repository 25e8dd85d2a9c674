"""Where glTF nodes put their meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from simplifier.errors import UnreadableMeshError
from simplifier.io.load import load
from simplifier.io.scene import load_scene
from tests.io.builders import (
    FAN,
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    TRIANGLE,
    GltfBuilder,
)


def rotation_z(degrees: float) -> list[float]:
    half = np.radians(degrees) / 2.0
    return [0.0, 0.0, float(np.sin(half)), float(np.cos(half))]


def test_nested_nodes_compose_scale_rotation_translation(load) -> None:
    builder = GltfBuilder()
    mesh = builder.mesh(TRIANGLE)
    leaf = builder.node(mesh=mesh, translation=[1, 0, 0], scale=[2, 3, 4])
    middle = builder.node(children=[leaf], rotation=rotation_z(90.0))
    matrix = [1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 10, 20, 30, 1]  # columns: x, z, -y, offset
    builder.node(children=[middle], matrix=matrix)
    # leaf: (1,0,0) (3,0,0) (1,3,0); turned: (0,1,0) (0,3,0) (-3,1,0); y becomes z; moved.
    expected = [[10, 20, 31], [10, 20, 33], [7, 20, 31]]
    np.testing.assert_allclose(load(builder)[0], expected, atol=1e-14)


def test_same_placement_as_trimesh(tmp_path: Path) -> None:
    generator = np.random.default_rng(5)
    builder = GltfBuilder()
    mesh = builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
    child: list[int] = []
    for _ in range(4):
        quaternion = generator.normal(size=4)
        node = builder.node(
            mesh=mesh,
            children=child,
            translation=generator.uniform(-5, 5, 3).tolist(),
            rotation=(quaternion / np.linalg.norm(quaternion)).tolist(),
            scale=generator.uniform(0.5, 2.0, 3).tolist(),
        )
        child = [node]
    builder.root |= {"scenes": [{"nodes": child}], "scene": 0}
    path = tmp_path / "scene.glb"
    path.write_bytes(builder.glb())
    ours = load(path)
    theirs = trimesh.load(path, process=False, force="mesh")
    key = lambda points: points[np.lexsort(np.round(points, 6).T)]  # noqa: E731
    np.testing.assert_allclose(key(ours.vertices), key(np.asarray(theirs.vertices)), atol=1e-9)


def test_map_coordinates_keep_float64(load) -> None:
    """The translation of a georeferenced scene would lose half a metre in float32."""
    builder = GltfBuilder()
    points = np.array(TRIANGLE, dtype=np.float32) * np.float32(0.001)
    leaf = builder.node(mesh=builder.mesh(points))
    builder.node(children=[leaf], translation=[1842000.123, 5176000.456, 0.0])
    expected = points.astype(float) + np.array([1842000.123, 5176000.456, 0.0])
    np.testing.assert_array_equal(load(builder)[0], expected)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -2, 1], [-1, -1, -1]])
def test_mirroring_turns_the_winding(load, scale: list[float]) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES), scale=scale)
    volume = np.linalg.det(load(builder)).sum() / 6.0
    assert volume == pytest.approx(abs(np.prod(scale)) / 6.0)


def test_two_mirrors_restore_the_winding(load) -> None:
    builder = GltfBuilder()
    leaf = builder.node(mesh=builder.mesh(TRIANGLE), scale=[-1, 1, 1])
    builder.node(children=[leaf], scale=[-1, 1, 1])
    np.testing.assert_array_equal(load(builder)[0], TRIANGLE)


def test_instances_of_one_mesh(load) -> None:
    builder = GltfBuilder()
    mesh = builder.mesh(TRIANGLE)
    for x in range(3):
        builder.node(mesh=mesh, translation=[10.0 * x, 0, 0])
    np.testing.assert_array_equal(load(builder)[:, 0, 0], [0.0, 10.0, 20.0])


def test_gpu_instances(load) -> None:
    builder = GltfBuilder()
    attributes = {
        "TRANSLATION": builder.accessor([[0, 0, 5], [0, 0, 7]], "VEC3", "f4"),
        "SCALE": builder.accessor([[1, 1, 1], [3, 3, 3]], "VEC3", "f4"),
    }
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    builder.node(mesh=builder.mesh(TRIANGLE), translation=[1, 0, 0], extensions=extension)
    corners = load(builder)
    np.testing.assert_array_equal(corners[:, 0], [[1, 0, 5], [1, 0, 7]])
    np.testing.assert_array_equal(corners[:, 1], [[2, 0, 5], [4, 0, 7]])


def test_gpu_instances_stand_between_other_nodes(tmp_path: Path) -> None:
    builder = GltfBuilder()
    mesh = builder.mesh(TRIANGLE)
    attributes = {"TRANSLATION": builder.accessor([[0, 0, 5], [0, 0, 7]], "VEC3", "f4")}
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    builder.node(name="first", mesh=mesh, translation=[1, 0, 0])
    builder.node(name="tree", mesh=mesh, translation=[2, 0, 0], extensions=extension)
    builder.node(name="last", mesh=mesh, translation=[3, 0, 0])
    path = tmp_path / "scene.glb"
    path.write_bytes(builder.glb())
    scene = load_scene(path)
    assert scene.names == ("first", "tree", "tree.2", "last")
    offsets = [[1, 0, 0], [2, 0, 5], [2, 0, 7], [3, 0, 0]]
    np.testing.assert_array_equal(scene.transforms[:, :3, 3], offsets)


def two_scenes() -> GltfBuilder:
    builder = GltfBuilder()
    for x in (0.0, 1.0, 2.0):
        builder.node(mesh=builder.mesh(TRIANGLE), translation=[x, 0, 0])
    builder.root["scenes"] = [{"nodes": [0]}, {"nodes": [2, 1]}]
    return builder


def test_the_default_scene_is_used(load) -> None:
    builder = two_scenes()
    builder.root["scene"] = 1
    np.testing.assert_array_equal(load(builder)[:, 0, 0], [2.0, 1.0])


def test_without_a_default_scene_all_nodes_count(load) -> None:
    np.testing.assert_array_equal(load(two_scenes())[:, 0, 0], [0.0, 1.0, 2.0])


def test_without_nodes_every_mesh_counts_once(load) -> None:
    builder = GltfBuilder()
    builder.mesh(TRIANGLE)
    builder.mesh(FAN, [0, 1, 2])
    assert len(load(builder)) == 2


@pytest.mark.parametrize(
    "children", [[[1], [0]], [[0]], [[1], [2], [1]], [[1, 2], [3], [3], []]], ids=str
)
@pytest.mark.parametrize("scene", [True, False])
def test_cycles_and_shared_children(load, children: list[list[int]], scene: bool) -> None:
    builder = GltfBuilder()
    mesh = builder.mesh(TRIANGLE)
    for nodes in children:
        builder.node(mesh=mesh, children=nodes)
    if scene:
        builder.root |= {"scene": 0, "scenes": [{"nodes": [0]}]}
    with pytest.raises(UnreadableMeshError, match="cycle"):
        load(builder)


def test_a_deep_tree_does_not_exhaust_the_stack(load) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(TRIANGLE), translation=[1, 0, 0])
    for index in range(5000):
        builder.node(children=[index], translation=[1, 0, 0])
    assert load(builder)[0, 0, 0] == 5001.0


def test_instances_cannot_multiply_a_file_beyond_memory(load) -> None:
    builder = GltfBuilder()
    indices = builder.accessor(np.zeros(60_000), "SCALAR", "u2")
    points = builder.accessor(TRIANGLE, "VEC3", "f4")
    one = {"attributes": {"POSITION": points}, "indices": indices}
    mesh = builder.primitives(*[one] * 10)
    for _ in range(501):
        builder.node(mesh=mesh)
    with pytest.raises(UnreadableMeshError, match="501 instances"):
        load(builder)


@pytest.mark.parametrize(
    ("node", "says"),
    [
        (5, r"'nodes\[3\]' is not an object"),
        ({"children": [7]}, r"nodes\[7\] is used, but there are 4"),
    ],
)
def test_nodes_that_are_none(load, node: object, says: str) -> None:
    builder = two_scenes()
    del builder.root["scenes"]
    builder.root["nodes"].append(node)
    with pytest.raises(UnreadableMeshError, match=says):
        load(builder)
