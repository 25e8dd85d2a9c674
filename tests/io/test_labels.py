"""What is left out of a file: by its names, and because one can see through it."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.errors import EmptyMeshError, OptionError, OverridesError
from simplifier.geometry.overrides import Ignore, Pattern
from simplifier.io.load import load, load_occluder
from simplifier.io.scene import load_scene
from tests.io.builders import TRIANGLE, GltfBuilder

MATERIALS = {
    "stone": {},
    "glass": {"alphaMode": "BLEND"},
    "leaf": {"alphaMode": "MASK", "alphaCutoff": 0.3},
    "plain": {"alphaMode": "OPAQUE"},
    "lens": {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}}},
    "solid": {"extensions": {"KHR_materials_transmission": {}, "KHR_materials_volume": {}}},
    "paper": {"extensions": {"KHR_materials_diffuse_transmission":
                             {"diffuseTransmissionFactor": 1.0}}},
}  # fmt: skip
SEE_THROUGH = ["glass", "leaf", "lens"]


def shifted(by):
    return (np.array(TRIANGLE) + np.array([0.0, 0.0, by])).tolist()


def gltf_of(names, **node):
    """One node with a primitive a material, at z = 0, 1, 2..."""
    builder = GltfBuilder()
    builder.root["materials"] = [{"name": name, **row} for name, row in MATERIALS.items()]
    numbers = {name: index for index, name in enumerate(MATERIALS)}
    primitives = [
        {
            "attributes": {"POSITION": builder.accessor(shifted(z), "VEC3", "f4")},
            "material": numbers[name],
        }
        for z, name in enumerate(names)
    ]
    builder.node(mesh=builder.primitives(*primitives), **node)
    return builder


def write(path, data):
    path.write_bytes(data)
    return path


def heights(mesh):
    """The z of each triangle."""
    return sorted(mesh.vertices[mesh.faces[:, 0], 2].tolist())


def named(*, meshes=(), materials=()):
    return Ignore(
        tuple(Pattern(text, f"a.toml:{line}") for line, text in enumerate(meshes, 1)),
        tuple(Pattern(text, f"a.toml:{line}") for line, text in enumerate(materials, 1)),
    )


def same(one, other):
    assert one.vertices.tobytes() == other.vertices.tobytes()
    assert one.faces.tobytes() == other.faces.tobytes()


def test_what_one_can_see_through_is_left_out_unless_it_is_asked_for(tmp_path):
    path = write(tmp_path / "a.glb", gltf_of(MATERIALS).glb())
    opaque = [z for z, name in enumerate(MATERIALS) if name not in SEE_THROUGH]
    found = load(path)
    assert heights(found) == opaque
    assert [(one.name, one.see_through, one.triangles) for one in found.omitted] == [
        (f"material '{name}'", True, 1) for name in SEE_THROUGH
    ]
    whole = load(path, transparent="keep")
    assert (len(whole.faces), whole.omitted) == (len(MATERIALS), ())
    assert len(load_occluder(path).faces) == len(MATERIALS)
    with pytest.raises(OptionError, match=r"transparent: 'no' is not known"):
        load(path, transparent="no")


@pytest.mark.parametrize("ignored", [["stone"], ["s*"], ["st?ne", "[p]aper", "glass"]])
def test_ignoring_a_material_is_loading_a_file_without_it(tmp_path, ignored):
    patterns = named(materials=ignored)
    kept = [
        name for name in MATERIALS if not any(one.matches([name]) for one in patterns.materials)
    ]
    builder = gltf_of(kept)
    position = {name: z for z, name in enumerate(MATERIALS)}
    builder = gltf_of(MATERIALS)
    primitives = builder.root["meshes"][0]["primitives"]
    path = write(tmp_path / "whole.glb", builder.glb())
    builder.root["meshes"][0]["primitives"] = [primitives[position[name]] for name in kept]
    without = write(tmp_path / "without.glb", builder.glb())
    for transparent in ("leave-out", "keep"):
        same(load(path, ignore=patterns, transparent=transparent),
             load(without, transparent=transparent))  # fmt: skip


def test_objects_are_ignored_by_the_name_of_node_or_mesh(tmp_path):
    builder = GltfBuilder()
    for z, (node, mesh) in enumerate(
        [("door", "a"), ("", "door.001"), ("wall", "b"), ("Door", "")]
    ):
        index = builder.mesh(shifted(z))
        builder.root["meshes"][index]["name"] = mesh
        builder.node(mesh=index, name=node)
    path = write(tmp_path / "a.glb", builder.glb())
    found = load(path, ignore=named(meshes=["door*"]))
    assert heights(found) == [2, 3]
    assert [one.name for one in found.omitted] == ["mesh 'door'", "mesh 'door.001'"]
    with pytest.raises(OverridesError) as refused:
        load(path, ignore=named(meshes=["b", "gate*"]))
    assert str(refused.value) == (
        "a.toml:2: no mesh is called 'gate*'; the file has 'door', 'a', 'door.001', 'wall', 'b'"
        " and 1 more"
    )


def test_all_instances_of_a_node_have_its_name(tmp_path):
    builder = GltfBuilder()
    places = builder.accessor([[0, 0, 0], [5, 0, 0]], "VEC3", "f4")
    builder.node(
        mesh=builder.mesh(shifted(0)), name="tree",
        extensions={"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}},
    )  # fmt: skip
    builder.node(mesh=builder.mesh(shifted(1)), name="ground")
    path = write(tmp_path / "a.glb", builder.glb())
    assert heights(load(path, ignore=named(meshes=["tree"]))) == [1]


@pytest.mark.parametrize(
    ("names", "ignore", "what"),
    [
        (SEE_THROUGH, named(), r"nothing opaque is left: 3 see-through .*'lens'\); keep them with "
                               r"--transparent keep"),
        (["stone"], named(materials=["stone"]), r"1 ignored triangle was .*; ignore less of it"),
    ],
)  # fmt: skip
def test_a_file_of_which_nothing_is_left_is_refused_with_what_helps(tmp_path, names, ignore, what):
    path = write(tmp_path / "a.glb", gltf_of(names).glb())
    with pytest.raises(EmptyMeshError, match=what):
        load(path, ignore=ignore)


@pytest.mark.parametrize("material", [7, -1, "x", True, None, 1.5, [0]])
def test_a_damaged_material_is_none(tmp_path, material):
    builder = gltf_of(["stone", "stone"])
    builder.root["meshes"][0]["primitives"][0]["material"] = material
    builder.root["materials"][1:] = [3, {"alphaMode": ["BLEND"], "extensions": []}]
    path = write(tmp_path / "a.glb", builder.glb())
    assert len(load(path).faces) == 2


def test_materials_without_a_name_are_called_by_their_number(tmp_path):
    builder = gltf_of(["stone", "glass"])
    for material in builder.root["materials"]:
        del material["name"]
    found = load(write(tmp_path / "a.glb", builder.glb()))
    assert [one.name for one in found.omitted] == ["material 'material 1'"]


OBJ = """\
mtllib my materials.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 0 1 1
f 1 2 3
o tower
usemtl stone
f 1 2 3 4
f 1 1 2
g frames panes
usemtl pane of glass
f 5 6 7
# usemtl nothing
f 5 6 7 \\
usemtl
o roof
f 1 5 7
"""
MTL = """\
newmtl stone
d 1.0
Tr 0
newmtl pane of glass
Kd 1 1 1
d -halo 0.4
newmtl leaf
map_d leaf.png
newmtl water
Tr 0.5
"""


def test_an_occluder_for_godot_is_left_out_and_told(tmp_path):
    """Of an earlier run, or by hand: it is no part of what is shown."""
    builder = gltf_of(["stone", "glass"], name="rock")
    builder.node(mesh=0, name="rock-occonly", translation=[0.0, 0.0, 5.0])
    path = write(tmp_path / "a.glb", builder.glb())
    found = load(path)
    assert heights(found) == [0.0]
    assert [(one.name, one.see_through, one.triangles) for one in found.omitted] == [
        ("material 'glass'", True, 1), ("occluder 'rock-occonly'", False, 2),
    ]  # fmt: skip
    assert heights(load(path, transparent="keep")) == [0.0, 1.0]
    scene = load_scene(path)
    assert scene.names == ("rock",)
    assert "object 'rock-occonly' left out: an occluder already" in scene.warnings[0]


def test_occluders_alone_are_a_mesh(tmp_path):
    path = write(tmp_path / "a.glb", gltf_of(["stone"], name="rock-occonly").glb())
    found = load(path)
    assert (heights(found), found.omitted) == ([0.0], ())
    assert load_scene(path).warnings == ()


def obj(tmp_path, text=OBJ, mtl=MTL):
    (tmp_path / "my materials.mtl").write_text(mtl)
    path = tmp_path / "a.obj"
    path.write_text(text.replace(" \\\nusemtl\n", "\n"))
    return path


def test_faces_of_obj_have_materials_objects_and_groups(tmp_path):
    path = obj(tmp_path)
    whole = load(path, transparent="keep")
    assert len(whole.faces) == 6
    found = load(path)
    assert len(found.faces) == 3
    assert [(one.name, one.triangles) for one in found.omitted] == [
        ("material 'pane of glass'", 3)
    ]  # fmt: skip
    for ignore, faces in (
        (named(materials=["stone"]), 4),
        (named(meshes=["tower"]), 2),
        (named(meshes=["panes"]), 3),
        (named(meshes=["roof"]), 5),
    ):
        assert len(load(path, transparent="keep", ignore=ignore).faces) == faces


@pytest.mark.parametrize("line", ["d 0.99", "d -halo 0.5", "Tr 0.1", "map_d x.png"])
def test_mtl_says_what_can_be_seen_through(tmp_path, line):
    path = obj(tmp_path, mtl=f"newmtl stone\n{line}\nnewmtl pane of glass\nd 1\nTr x\n")
    assert [one.name for one in load(path).omitted] == ["material 'stone'"]


@pytest.mark.parametrize("line", ["Tr 1.000000", "d 1.0\nTr 1.0", "Tr 0"])
def test_what_is_opaque_to_either_reading_of_tr_is_kept(tmp_path, line):
    """A scan that MeshLab had written was refused, since nothing opaque was left of it."""
    path = obj(tmp_path, mtl=f"newmtl stone\n{line}\nnewmtl pane of glass\n{line}\n")
    assert load(path).omitted == ()


def test_no_material_file_is_opened_where_none_may_be_nor_outside_of_the_folder(tmp_path):
    path = obj(tmp_path)
    assert load(path, allow_external=False).omitted == ()
    assert len(load(path, allow_external=False, ignore=named(materials=["stone"])).faces) == 4
    inner = tmp_path / "inner"
    inner.mkdir()
    for name in ("../my materials.mtl", str(tmp_path / "my materials.mtl"), "none.mtl", "a\1b"):
        mesh = inner / "a.obj"
        mesh.write_text(path.read_text().replace("my materials.mtl", name))
        assert load(mesh).omitted == ()


def test_several_material_files_may_stand_in_one_line(tmp_path):
    path = obj(tmp_path, OBJ.replace("my materials.mtl", "one.mtl two.mtl"))
    (tmp_path / "one.mtl").write_text("newmtl stone\nd 1\n")
    (tmp_path / "two.mtl").write_bytes(MTL.replace("\n", "\r\n").encode())
    assert [one.name for one in load(path).omitted] == ["material 'pane of glass'"]


def test_a_statement_that_a_backslash_joins_to_the_line_before_is_none(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\nusemtl x\n".replace("\\\nusemtl x", "\\\n3")
    path = tmp_path / "a.obj"
    path.write_text(text + "# \\\nusemtl x\nf 1 2 3\n")
    with pytest.raises(OverridesError, match="the file names no material"):
        load(path, ignore=named(materials=["x"]))


def test_ignoring_an_obj_material_is_loading_a_file_without_its_faces(tmp_path):
    """Quads that are cut in ways of their own, before and after."""
    rng = np.random.default_rng(3)
    rows = [f"v {x} {y} {z}" for x, y, z in rng.normal(size=(40, 3)).tolist()]
    groups = {name: [rng.choice(40, rng.integers(3, 7), replace=False) + 1 for _ in range(6)]
              for name in "abc"}  # fmt: skip
    text = {
        name: "\n".join([f"usemtl {name}", *("f " + " ".join(map(str, face)) for face in faces)])
        for name, faces in groups.items()
    }
    whole, without = tmp_path / "whole.obj", tmp_path / "without.obj"
    whole.write_text("\n".join([*rows, *text.values(), ""]))
    without.write_text("\n".join([*rows, text["a"], text["c"], ""]))
    same(load(whole, ignore=named(materials=["b"])), load(without))


def test_a_format_without_names_has_nothing_to_ignore(tmp_path):
    path = tmp_path / "a.stl"
    path.write_text("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                    "vertex 0 1 0\nendloop\nendfacet\nendsolid\n")  # fmt: skip
    assert load(path).omitted == ()
    with pytest.raises(
        OverridesError, match=r"a\.toml:1: no mesh is called 'x'; the file names no"
    ):
        load(path, ignore=named(meshes=["x"]))


# Scenes follow the same rule.


def test_a_scene_is_without_what_one_can_see_through(tmp_path):
    builder = gltf_of(["stone", "glass"], name="house")
    for name in ("glass", "stone"):
        primitive = {
            "attributes": {"POSITION": builder.accessor(shifted(9), "VEC3", "f4")},
            "material": list(MATERIALS).index(name),
        }
        builder.node(mesh=builder.primitives(primitive), name=f"pane of {name}")
    path = write(tmp_path / "a.glb", builder.glb())
    scene = load_scene(path)
    assert scene.names == ("house", "pane of stone")
    assert scene.triangle_counts.tolist() == [1, 1]
    assert scene.warnings == (
        "object 'pane of glass' left out: all of it is see-through; keep them with --transparent"
        ' keep (transparent="keep" in Python)',
        "1 see-through triangle left out of 'house'; keep them with --transparent keep"
        ' (transparent="keep" in Python)',
    )
    whole = load_scene(path, transparent="keep")
    assert (len(whole.names), whole.warnings) == (3, ())


def test_the_files_of_a_folder_follow_it_too(tmp_path):
    obj(tmp_path)
    write(tmp_path / "b.glb", gltf_of(["glass"]).glb())
    scene = load_scene(tmp_path)
    assert scene.names == ("a",)
    assert scene.triangle_counts.tolist() == [3]
    assert any("3 see-through triangles left out of 'a'" in one for one in scene.warnings)
    assert load_scene(tmp_path, transparent="keep").triangle_counts.tolist() == [6, 1]
