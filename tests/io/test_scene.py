"""Scenes read from real files on disk: objects, names, shared meshes, and every warning."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import EmptyMeshError, UnknownFormatError, UnreadableMeshError
from simplifier.io.load import load
from simplifier.io.scene import load_scene
from tests.io.builders import (
    FAN,
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    TRIANGLE,
    GltfBuilder,
    tetrahedron_gltf,
    text_obj,
    text_off,
    text_ply,
    valid_files,
)


@pytest.fixture
def scene(tmp_path):
    """The scene that a builder's file holds."""

    def load(builder):
        path = tmp_path / "scene.glb"
        path.write_bytes(builder.glb())
        return load_scene(path)

    return load


def tetrahedron(builder):
    return builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)


def write(folder, files):
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder


# Objects of a glTF file


def test_a_node_is_an_object_and_a_mesh_is_kept_once(scene):
    builder = GltfBuilder()
    one, other = tetrahedron(builder), builder.mesh(FAN, [0, 1, 2, 0, 2, 3])
    leaf = builder.node(name="leaf", mesh=one, translation=[1, 0, 0])
    builder.node(name="branch", children=[leaf], scale=[2, 2, 2])
    builder.node(name="root", mesh=other)
    builder.node(name="again", mesh=one, translation=[0, 0, 9])
    found = scene(builder)
    assert found.names == ("leaf", "root", "again")
    assert found.warnings == ()
    assert len(found.meshes) == 2
    assert found.mesh_of.tolist() == [0, 1, 0]
    assert found.mesh_of.dtype == np.int32
    np.testing.assert_array_equal(found.transforms[0, :3, 3], [2, 0, 0])
    np.testing.assert_array_equal(found.bounds()[:, 1], [[4, 2, 2], [1, 1, 0], [1, 1, 10]])


def test_the_same_triangles_as_the_mesh_loader(tmp_path):
    generator = np.random.default_rng(3)
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    children: list[int] = []
    for _ in range(4):
        children = [
            builder.node(
                mesh=mesh,
                children=children,
                translation=generator.uniform(-5, 5, 3).tolist(),
                rotation=generator.normal(size=4).tolist(),
                scale=generator.uniform(0.5, 2.0, 3).tolist(),
            )
        ]
    path = tmp_path / "scene.glb"
    path.write_bytes(builder.glb())
    found, mesh_way = load_scene(path), load(path)
    joined = found.joined(range(len(found)))
    np.testing.assert_allclose(
        joined.vertices[joined.faces], mesh_way.vertices[mesh_way.faces], atol=1e-12
    )


def test_gpu_instances_are_objects_numbered_by_their_node(scene):
    builder = GltfBuilder()
    places = builder.accessor([[0, 0, 5], [0, 0, 7], [0, 0, 9]], "VEC3", "f4")
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}
    builder.node(name="wood", mesh=tetrahedron(builder), scale=[2, 2, 2], extensions=extension)
    found = scene(builder)
    assert found.names == ("wood", "wood.2", "wood.3")
    assert found.warnings == ()
    assert len(found.meshes) == 1
    assert found.transforms[:, 2, 3].tolist() == [10.0, 14.0, 18.0]


def test_map_coordinates_stay_in_the_transform(scene):
    builder = GltfBuilder()
    leaf = builder.node(mesh=tetrahedron(builder), translation=[0.125, 0, 0])
    builder.node(children=[leaf], translation=[1842000.123, 5176000.456, 0.0])
    found = scene(builder)
    assert found.transforms[0, 0, 3] == 1842000.123 + 0.125
    assert found.meshes[0].vertices.max() == 1.0


def test_names_of_nodes_without_one(scene):
    builder = GltfBuilder()
    tetrahedron(builder)
    builder.mesh(FAN, [0, 1, 2])
    builder.root["meshes"][1]["name"] = "fan"
    builder.node(mesh=0)
    builder.node(mesh=1)
    builder.node(mesh=0, name="")
    builder.node(mesh=0, name=7)
    assert scene(builder).names == ("node 0", "fan", "node 2", "node 3")


def test_without_nodes_every_mesh_is_an_object(scene):
    builder = GltfBuilder()
    tetrahedron(builder)
    builder.mesh(FAN, [0, 1, 2])
    builder.root["meshes"][1]["name"] = "fan"
    assert scene(builder).names == ("mesh 0", "fan")


def test_repeated_names_are_numbered_with_one_warning(scene):
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    for name in ("tree", "tree", "tree.2", "house", "tree", "house", "rock"):
        builder.node(mesh=mesh, name=name)
    found = scene(builder)
    assert found.names == ("tree", "tree.3", "tree.2", "house", "tree.4", "house.2", "rock")
    (warning,) = found.warnings
    assert "3 are called 'tree'" in warning
    assert "2 are called 'house'" in warning
    assert "rock" not in warning


def test_names_that_no_file_can_hold_are_made_so(scene):
    builder = GltfBuilder()
    mesh = builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
    for name in ("\ud800x", "?x", "\x1b[2J"):
        builder.node(mesh=mesh, name=name)
    builder.node(mesh=mesh, name="\x1b[3J", scale=[0, 1, 1])
    found = scene(builder)
    assert found.names == ("?x", "?x.2", "\x1b[2J")
    assert all(warning.isprintable() for warning in found.warnings)
    assert len(found.warnings) == 2


def test_a_warning_lists_a_few_names_and_counts_the_rest(scene):
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    for name in range(9):
        builder.node(mesh=mesh, name=f"n{name}")
        builder.node(mesh=mesh, name=f"n{name}")
    (warning,) = scene(builder).warnings
    assert "'n4' and 4 more" in warning
    assert "'n5'" not in warning


def test_equal_meshes_stored_several_times_become_one(scene):
    builder = GltfBuilder()
    for x in range(4):
        builder.node(mesh=tetrahedron(builder), name=f"copy {x}", translation=[x, 0, 0])
    moved = np.add(TETRAHEDRON_POINTS, [0.0, 0.0, 1e-6])
    builder.node(mesh=builder.mesh(moved, TETRAHEDRON_FACES), name="nearly")
    builder.node(mesh=builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES[::-1]), name="other order")
    found = scene(builder)
    assert found.mesh_of.tolist() == [0, 0, 0, 0, 1, 2]
    assert len(found.meshes) == 3


# What is left out


@pytest.mark.parametrize(
    ("node", "reason"),
    [
        ({"scale": [1, 0, 1]}, "flattens"),
        ({"scale": [1, 1, 1e-13]}, "flattens"),
        ({"matrix": [1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0, 0, 0, 0, 1]}, "flattens"),
        ({"translation": [0, float("nan"), 0]}, "not finite"),
        ({"rotation": [0, 0, None, 1]}, "not finite"),
        ({"scale": [float("inf"), 1, 1]}, "not finite"),
        ({"matrix": [*np.eye(4).ravel()[:12].tolist(), "x", 0, 0, 1]}, "not finite"),
        ({"matrix": [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}, "last row"),
        ({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2]}, "last row"),
        ({"translation": [0, 1e200, 0]}, "too far out"),
    ],
)
def test_an_object_with_a_broken_transform_is_left_out(scene, node, reason):
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    builder.node(mesh=mesh, name="good")
    builder.node(mesh=mesh, name="bad", **node)
    found = scene(builder)
    assert found.names == ("good",)
    (warning,) = found.warnings
    assert "object 'bad' left out" in warning
    assert reason in warning
    assert ";" in warning  # and what to do


def test_a_broken_transform_reaches_the_children(scene):
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    child = builder.node(mesh=mesh, name="child")
    builder.node(children=[child], translation=[0, None, 0])
    builder.node(mesh=mesh, name="good")
    found = scene(builder)
    assert found.names == ("good",)
    assert "object 'child' left out: a transform that is not finite" in found.warnings[0]


def test_an_instance_that_is_not_finite_is_left_out_alone(scene):
    builder = GltfBuilder()
    places = builder.accessor([[0, 0, 5], [0, np.nan, 7], [0, 0, 9]], "VEC3", "f4")
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}
    builder.node(name="wood", mesh=tetrahedron(builder), extensions=extension)
    found = scene(builder)
    assert found.names == ("wood", "wood.3")
    assert "object 'wood.2' left out" in found.warnings[0]


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1e-5, 1e5, 1], [1e-30, 1e-30, 1e-30], [-2, -2, -2]])
def test_mirrored_and_stretched_objects_are_kept_without_a_word(scene, scale):
    builder = GltfBuilder()
    builder.node(mesh=tetrahedron(builder), scale=scale)
    found = scene(builder)
    assert len(found) == 1
    assert found.warnings == ()
    np.testing.assert_array_equal(np.diag(found.transforms[0])[:3], scale)


def test_objects_without_triangles_are_left_out_in_one_warning_a_reason(scene):
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    lines = builder.mesh(TRIANGLE, mode=1)
    collapsed = builder.mesh(TRIANGLE, [0, 1, 1, 2, 2, 0])
    builder.node(mesh=lines, name="lines")
    builder.node(mesh=mesh, name="solid")
    builder.node(mesh=collapsed, name="collapsed")
    builder.node(mesh=lines, name="more lines")
    builder.node(mesh=mesh, name="flat", scale=[0, 1, 1])
    found = scene(builder)
    assert found.names == ("solid",)
    assert len(found.meshes) == 1
    empty, flat = found.warnings
    assert "objects 'lines', 'collapsed', 'more lines' left out: no triangle" in empty
    assert "object 'flat' left out" in flat


def test_unusable_triangles_are_counted_in_one_warning(scene):
    builder = GltfBuilder()
    good = tetrahedron(builder)
    points = [*TETRAHEDRON_POINTS, [np.nan, 0, 0], [2, 0, 0]]
    broken = builder.mesh(points, [*TETRAHEDRON_FACES, [0, 1, 4], [0, 1, 1], [0, 1, 5], [2, 2, 2]])
    other = builder.mesh(TRIANGLE, [0, 1, 2, 0, 0, 1])
    builder.node(mesh=good, name="whole")
    for name in ("first", "second"):
        builder.node(mesh=broken, name=name)
    builder.node(mesh=other, name="third")
    found = scene(builder)
    assert len(found) == 4
    (warning,) = found.warnings
    assert warning.startswith("5 unusable triangles left out")
    assert "1 not finite, 3 with a repeated corner, 1 without area" in warning
    assert "'first'" in warning
    assert found.triangle_counts.tolist() == [4, 4, 4, 1]


def test_a_scene_without_a_usable_object_is_refused(scene):
    builder = GltfBuilder()
    builder.node(mesh=tetrahedron(builder), name="flat", scale=[1, 1, 0])
    with pytest.raises(EmptyMeshError, match="object 'flat' left out: a transform that flattens"):
        scene(builder)


def test_a_file_without_meshes_is_refused(scene):
    builder = GltfBuilder()
    builder.node(name="empty")
    with pytest.raises(EmptyMeshError, match="no object with a mesh; export it with meshes"):
        scene(builder)


def test_more_than_ten_million_objects_are_refused_before_they_are_made(scene):
    """Eleven nodes claim a million instances each by accessors without data."""
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    zeros = builder.raw_accessor(componentType=5126, count=1_000_000, type="VEC3")
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": zeros}}}
    for _ in range(11):
        builder.node(mesh=mesh, extensions=extension)
    begin = time.perf_counter()
    with pytest.raises(UnreadableMeshError, match="11000000 objects, more than 10000000"):
        scene(builder)
    assert time.perf_counter() - begin < 2.0


def test_instances_may_add_up_to_any_number_of_triangles(scene):
    """501 x 200,000: the mesh loader refuses such a file because it would copy the triangles."""
    builder = GltfBuilder()
    indices = builder.accessor(np.tile([0, 1, 2], 20_000), "SCALAR", "u2")
    points = builder.accessor(TRIANGLE, "VEC3", "f4")
    one = {"attributes": {"POSITION": points}, "indices": indices}
    mesh = builder.primitives(*[one] * 10)
    for _ in range(501):
        builder.node(mesh=mesh)
    found = scene(builder)
    assert found.triangle_counts.sum() == 501 * 200_000


def test_a_structural_fault_is_still_an_error(scene):
    builder = GltfBuilder()
    builder.node(mesh=tetrahedron(builder), matrix=[1, 0, 0])
    with pytest.raises(UnreadableMeshError, match="'matrix' is not an array of 16 numbers"):
        scene(builder)


def test_tens_of_thousands_of_nodes(tmp_path):
    """A quarter of a second; what grows with the square of the nodes takes minutes here."""
    builder = GltfBuilder()
    mesh = tetrahedron(builder)
    matrix = np.eye(4).ravel().tolist()
    for index in range(20_000):
        matrix[12] = float(index)
        builder.root["nodes"].append({"mesh": mesh, "name": f"n{index}", "matrix": [*matrix]})
    path = tmp_path / "many.glb"
    path.write_bytes(builder.glb())
    found = load_scene(path)
    assert len(found) == 20_000
    assert found.transforms[-1, 0, 3] == 19_999.0


# Other files


@pytest.mark.parametrize("name", valid_files())
def test_every_format_gives_one_object(tmp_path, name):
    suffix, content = valid_files()[name]
    path = tmp_path / f"rock.v2{suffix}"
    path.write_bytes(content)
    found = load_scene(path)
    assert found.triangle_counts.tolist() == [4]
    np.testing.assert_array_equal(found.transforms, np.eye(4)[None])
    own = {".glb": "node 0", ".gltf": "node 0", ".3mf": "body", ".dae": "node"}
    assert found.names == (own.get(suffix, "rock.v2"),)


def test_an_absent_and_an_unknown_file(tmp_path):
    with pytest.raises(UnreadableMeshError, match="no such file"):
        load_scene(tmp_path / "absent.glb")
    with pytest.raises(UnknownFormatError, match=r"\.fbx"):
        load_scene(tmp_path / "absent.fbx")


# Folders


def test_a_folder_s_files_are_objects_by_relative_path(tmp_path):
    builder = tetrahedron_gltf()
    builder.root["nodes"][0]["name"] = "spire"
    builder.node(mesh=0, translation=[5, 0, 0])
    files = {
        "town/b.obj": text_obj(),
        "a.v2.ply": text_ply(),
        "town/church.glb": builder.glb(),
        "Z.OFF": text_off(),
        "notes.txt": b"not a mesh",
        ".hidden.ply": text_ply(),
        ".git/inside.ply": text_ply(),
    }
    found = load_scene(write(tmp_path / "assets", files))
    assert found.names == ("Z", "a.v2", "town/b", "town/church/spire", "town/church/node 1")
    assert found.warnings == ()
    assert found.transforms[-1, 0, 3] == 5.0


def test_equal_meshes_of_a_folder_are_shared(tmp_path):
    files = {"a.obj": text_obj(), "b.off": text_off(), "c.ply": text_ply(), "d.obj": text_obj()}
    found = load_scene(write(tmp_path, files))
    assert len(found) == 4
    assert len(found.meshes) == 1


def test_a_file_that_cannot_be_read_becomes_a_warning(tmp_path):
    files = {
        "good.obj": text_obj(),
        "cut.ply": text_ply()[:-20],
        "page.stl": b"<html>404</html>",
        "empty.off": b"",
        "nothing.obj": b"v 0 0 0\n",
        "beyond.off": text_off().replace(b"3 0 2 1", b"3 0 2 9"),
    }
    found = load_scene(write(tmp_path, files))
    assert found.names == ("good",)
    text = "\n".join(found.warnings)
    for name in ("cut.ply", "page.stl", "empty.off"):
        assert str(tmp_path / name) in text
    assert "object 'nothing' left out" in text or "nothing.obj" in text
    assert "beyond" in text
    assert len(found.warnings) == 5


def test_overrides_that_a_scene_passes_over_are_told(tmp_path):
    files = {
        "a.obj": text_obj(),
        "a.ply": text_ply(),
        "a.overrides.toml": b"no TOML, and nobody reads it",
        "b.overrides.toml": b"",
        "deep/c.off": text_off(),
        "deep/c.overrides.toml": b"",
    }
    write(tmp_path, files)
    words = "overrides are for single meshes; a scene takes none"
    told = load_scene(tmp_path).warnings[0]
    assert told == f"{tmp_path / 'a.overrides.toml'} and 1 more: {words}"
    file = load_scene(tmp_path / "deep/c.off")
    assert file.warnings == (f"{tmp_path / 'deep/c.overrides.toml'}: {words}",)


def test_files_of_one_name_are_numbered(tmp_path):
    found = load_scene(write(tmp_path, {"a.obj": text_obj(), "a.off": text_off()}))
    assert found.names == ("a", "a.2")
    assert "2 are called 'a'" in found.warnings[0]


def test_a_folder_without_mesh_files_is_refused(tmp_path):
    write(tmp_path, {"readme.md": b"x", ".hidden.ply": text_ply()})
    with pytest.raises(EmptyMeshError, match=r"holds no mesh file; put files there .*\.glb"):
        load_scene(tmp_path)


def test_a_folder_of_unreadable_files_says_why(tmp_path):
    write(tmp_path, {"a.ply": b"", "b.ply": b""})
    with pytest.raises(EmptyMeshError, match=r"a\.ply: the file is empty"):
        load_scene(tmp_path)


def test_a_folder_whose_objects_cannot_be_used_is_refused(tmp_path):
    write(tmp_path, {"a.obj": b"v 0 0 0\nv 1 0 0\nf 1 2 2\n"})
    with pytest.raises(EmptyMeshError, match="object 'a' left out"):
        load_scene(tmp_path)


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_forbidden_folder_becomes_a_warning(tmp_path):
    write(tmp_path, {"good.obj": text_obj(), "shut/a.obj": text_obj()})
    (tmp_path / "shut").chmod(0)
    try:
        found = load_scene(tmp_path)
    finally:
        (tmp_path / "shut").chmod(0o700)
    assert found.names == ("good",)
    assert "shut: the folder cannot be read" in found.warnings[0]


def test_a_link_back_to_the_folder_does_not_go_round_for_ever(tmp_path):
    write(tmp_path, {"in/good.obj": text_obj()})
    (tmp_path / "in" / "loop").symlink_to(tmp_path, target_is_directory=True)
    assert load_scene(tmp_path).names == ("in/good",)


# Real scenes


@pytest.mark.sweep(3)
@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("city_lyon_buildings.glb", 2576),
        ("sponza_dabrovic.glb", 34),
        ("building_duplex.glb", 215),
        ("building_fzk_haus.glb", 83),
        ("cad_reciprocating_saw.glb", 113),
        ("machine_anymal_kinova_395k.glb", 135),
    ],
)
def test_objects_of_real_scenes(asset, name, count):
    path: Path = asset(name)
    found, mesh = load_scene(path), load(path)
    assert len(found) == count
    assert len(set(found.names)) == count
    assert found.triangle_counts.sum() == len(mesh.faces)
    boxes = found.bounds()
    whole = [boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]
    np.testing.assert_allclose(whole, mesh.bounds, rtol=0.0, atol=1e-12 * np.abs(whole).max())


def test_the_lyon_block(asset):
    found = load_scene(asset("city_lyon_buildings.glb"))
    assert found.names[0] == "BATIMENT0000002006452343"
    (warning,) = found.warnings
    assert warning.startswith("5294 unusable triangles")
