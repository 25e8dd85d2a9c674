"""scene.json: what is written is read, as the schema says, and no damage gives a broken tree."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from simplifier.errors import SceneError
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import FAR, NEAR
from simplifier.hierarchy.scene_file import (
    load_occluder_tree,
    occluder_store,
    read_earlier,
    write_manifest,
)
from tests.hierarchy.builds import built, files
from tests.hierarchy.scenes import QUICK, fine_box, moved, scene_of, street, turned

SCHEMA = json.loads((Path(__file__).parents[2] / "docs" / "scene.schema.json").read_text())
STREET = street(16)
MISSING = object()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(folder, build); not to be changed."""
    folder = tmp_path_factory.mktemp("whole")
    large = fine_box((30.0, 1.0, 1.0), cuts=4)  # cut into pieces
    scene = Scene(
        (*STREET.meshes, large),
        (*STREET.names, 'wall}, {"bounds"', "wall\n"),
        np.append(STREET.mesh_of, [2, 2]).astype(np.int32),
        np.concatenate(
            [STREET.transforms, [moved(0, 0, 9), moved(0, 0, 12, -0.5 * turned("y", 9.0))]]
        ),
        ("a tree was left out",),
    )
    return folder, built(scene, folder), scene


@pytest.fixture
def folder(whole, tmp_path):
    for name, data in files(whole[0]).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(data)
    return tmp_path


def document_of(folder):
    return json.loads((folder / "scene.json").read_text())


def test_the_tree_comes_back_as_it_was(whole):
    folder, build, scene = whole
    loaded = load_occluder_tree(str(folder))
    for name in ("bounds", "children", "spans", "order"):
        there, here = getattr(loaded.tree, name), getattr(build.tree, name)
        np.testing.assert_array_equal(there, here)
        assert there.dtype == here.dtype
    assert loaded.options == QUICK
    assert loaded.objects == scene.names
    np.testing.assert_array_equal(loaded.object_of, build.parts.object_of)
    np.testing.assert_array_equal(loaded.transforms, build.parts.scene.transforms)
    store = occluder_store(folder)
    for node, keys in enumerate(build.keys):
        for level, key in ((FAR, keys.far), (NEAR, keys.near)):
            place = loaded.occluder_of[node, level]
            assert (place < 0) == (key is None)
            if key is not None:
                expected, found = store.read(key), loaded.occluders[place]
                np.testing.assert_array_equal(found.vertices, expected.vertices)
                np.testing.assert_array_equal(found.faces, expected.faces)
                assert found.error_bound == build.summaries[key].error_bound
                assert loaded.radii[place] == build.summaries[key].radius


def test_what_is_in_the_world(whole):
    tree = load_occluder_tree(whole[0])
    errors, radii, counts = tree.errors(), tree.hiding_radii(), tree.triangle_counts()
    for node, level in np.argwhere(tree.occluder_of >= 0):
        points, faces, error = tree.placed(node, level)
        assert (errors[node, level], counts[node, level]) == (error, len(faces))
        assert radii[node, level] > 0.0
        low, high = tree.tree.bounds[node]
        slack = error + 1e-6 * (high - low).max()
        assert (points >= low - slack).all()
        assert (points <= high + slack).all()
    nothing = tree.occluder_of < 0
    assert np.isinf(errors[nothing]).all()
    assert (radii[nothing] == 0.0).all()
    assert (counts[nothing] == 0).all()
    assert (errors[:, NEAR][~nothing[:, NEAR]] == 0.0).all()


def test_is_as_the_schema_says(whole):
    folder, build, _ = whole
    document = document_of(folder)
    Draft202012Validator.check_schema(SCHEMA)
    Draft202012Validator(SCHEMA).validate(document)
    assert set(SCHEMA["$defs"]["options"]["properties"]) == set(QUICK.chosen())
    assert document["warnings"] == ["a tree was left out"]
    assert {row["file"] for row in document["occluders"].values()} == set(files(folder)) - {
        "scene.json"
    }
    pieces = [row for row in document["nodes"] if row.get("object") == 16]
    assert len(pieces) > 1
    lines = (folder / "scene.json").read_text().splitlines()
    assert len(lines) == len(build.tree)  # a node a line, for who looks at differences


def test_every_property_of_the_schema_is_described():
    def check(schema, name):
        for key, value in schema.get("properties", {}).items():
            target = value
            if "$ref" in value and "description" not in value:
                target = SCHEMA["$defs"][value["$ref"].rpartition("/")[2]]
            described = "description" in target or "properties" in target or "prefixItems" in target
            assert described, (name, key)
        if schema.get("type") == "object" and "propertyNames" not in schema:
            assert schema["additionalProperties"] is False, name

    check(SCHEMA, "root")
    for name, schema in SCHEMA["$defs"].items():
        check(schema, name)


def test_a_scene_of_one_object(tmp_path):
    scene = scene_of([fine_box(low=(1e7, 0.0, -1e7))], [0], [moved()])
    build = built(scene, tmp_path)
    Draft202012Validator(SCHEMA).validate(document_of(tmp_path))
    tree = load_occluder_tree(tmp_path)
    assert len(tree.tree) == len(build.tree) == 1
    assert tree.occluder_of[0, NEAR] >= 0


def test_a_name_that_python_alone_can_hold(tmp_path):
    """Half of a character that takes two: to write it ended a build with a traceback."""
    scene = replace(scene_of([fine_box()], [0], [moved()]), names=("half \ud800",))
    built(scene, tmp_path)
    assert load_occluder_tree(tmp_path).objects == scene.names


@pytest.mark.parametrize("what", ["bounds", "transform", "radius"])
def test_no_manifest_says_null_for_a_number(tmp_path, what):
    scene = street(3)
    build = built(scene, tmp_path)
    before = files(tmp_path)
    if what == "bounds":
        build = replace(build, tree=replace(build.tree, bounds=build.tree.bounds * np.nan))
    elif what == "transform":
        endless = np.full_like(build.parts.scene.transforms, np.inf)
        parts = replace(build.parts.scene, transforms=endless)
        build = replace(build, parts=replace(build.parts, scene=parts))
    else:
        key, summary = min(build.summaries.items())
        damaged = {key: replace(summary, radius=np.nan)}
        build = replace(build, summaries={**build.summaries, **damaged})
    with pytest.raises(ValueError, match=r"finite|JSON compliant"):
        write_manifest(tmp_path, scene, QUICK, build)
    assert files(tmp_path) == before


def test_summaries_come_back(whole):
    folder, build, _ = whole
    assert read_earlier(folder).summaries == build.summaries


# What to change, where, and what the message has to say of it.
DAMAGE = [
    *[((key,), MISSING, key) for key in ("options", "objects", "nodes", "occluders")],
    (("schema_version",), MISSING, "schema version None"),
    *[((key,), 7, "") for key in ("options", "objects", "nodes", "occluders")],
    *[((key,), [], "") for key in ("options", "objects", "nodes", "occluders")],
    (("schema_version",), 2, "schema version 2"),
    (("schema_version",), "1", "schema version '1'"),
    (("options", "width"), MISSING, "width"),
    (("options", "width"), "8", "width"),
    (("options", "fov"), None, "fov"),
    (("objects", 0), 3, "objects"),
    (("objects", 0), "object 1", "same name"),
    (("nodes", 0), [], "node 0"),
    (("nodes", 0, "bounds"), MISSING, "bounds"),
    (("nodes", 0, "bounds"), [[0, 0, 0]], "bounds"),
    (("nodes", 0, "bounds"), [[0, 0, 0], [1, 1]], ""),
    (("nodes", 0, "bounds", 0, 0), "0", "bounds"),
    (("nodes", 0, "bounds", 0, 0), None, "bounds"),
    (("nodes", 0, "bounds", 0, 0), float("nan"), "bounds"),
    (("nodes", 0, "bounds", 0, 0), 10**400, "bounds"),
    (("nodes", 0, "bounds", 0, 0), 1e9, "above its highest"),
    (("nodes", 0, "children"), MISSING, "node 0"),
    (("nodes", 0, "children"), [1, 1000000], "order of their parents"),
    (("nodes", 0, "children"), [1, 10**30], "children"),
    (("nodes", 0, "children"), [-1, 4], "order of their parents"),
    (("nodes", 0, "children"), [1.0, 4.0], "children"),
    (("nodes", 0, "children"), [0, 4], "order of their parents"),
    (("nodes", 0, "children"), "14", "children"),
    (("nodes", 0, "near"), "0" * 32, "node 0"),
    (("nodes", 0, "colour"), "red", "node 0"),
    (("nodes", -1, "part"), MISSING, "part"),
    (("nodes", -1, "part"), 0, "once"),
    (("nodes", -1, "part"), -1, "once"),
    (("nodes", -1, "part"), 10**6, "once"),
    (("nodes", -1, "part"), 1.5, "part"),
    (("nodes", -1, "object"), 10**6, "not there"),
    (("nodes", -1, "object"), -1, "not there"),
    (("nodes", -1, "object"), MISSING, "object"),
    (("nodes", -1, "object"), 0, "order of the objects"),
    (("nodes", -1, "transform"), MISSING, "transform"),
    (("nodes", -1, "transform"), [[1, 0, 0, 0]] * 4, "transform"),
    (("nodes", -1, "transform", 0, 0), float("inf"), "transform"),
    (("nodes", -1, "near"), "0" * 32, "not there"),
    (("nodes", -1, "near"), "../../secret", "not there"),
    (("nodes", -1, "near"), ["a"], ""),
    (("nodes", -1, "near"), 5, "not there"),
]  # fmt: skip


def changed(document, path, value):
    found = copy.deepcopy(document)
    at = found
    for step in path[:-1]:
        at = at[step]
    if value is MISSING:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return found


@pytest.mark.parametrize(("path", "value", "said"), DAMAGE)
def test_damage_is_named(folder, path, value, said):
    document = changed(document_of(folder), path, value)
    (folder / "scene.json").write_text(json.dumps(document))
    with pytest.raises(SceneError) as caught:
        load_occluder_tree(folder)
    assert caught.value.where == str(folder / "scene.json")
    assert said in caught.value.what
    assert "build the scene" in caught.value.remedy
    if said != "" and value is not MISSING and "schema version" not in said:
        read_earlier(folder)  # raises nothing


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("triangles", MISSING), ("triangles", 1.5), ("triangles", -1), ("triangles", "3"),
        ("error_bound", -1.0), ("error_bound", float("inf")), ("error_bound", None),
        ("radius", float("nan")), ("radius", []), ("checksum", -1), ("checksum", MISSING),
        ("checksum", 10**40),
    ],
)  # fmt: skip
def test_damaged_summaries(folder, name, value):
    document = document_of(folder)
    key = min(document["occluders"])
    (folder / "scene.json").write_text(
        json.dumps(changed(document, ("occluders", key, name), value))
    )
    with pytest.raises(SceneError, match=key):
        load_occluder_tree(folder)
    assert read_earlier(folder).summaries == {}


@pytest.mark.parametrize(
    "key", ["../" + "0" * 29, "../../../../etc/passwd", "0" * 31, "", "A" * 32]
)
def test_keys_that_lead_elsewhere(folder, key):
    document = document_of(folder)
    old = next(row["near"] for row in document["nodes"] if "near" in row)
    text = json.dumps(document).replace(old, key)
    (folder / "scene.json").write_text(text)
    with pytest.raises(SceneError, match="not a key"):
        load_occluder_tree(folder)
    assert read_earlier(folder).summaries == {}


def test_cycles_and_shared_children(folder):
    """Nodes that share their children made a walk through the tree take for ever."""
    leaf = next(row for row in document_of(folder)["nodes"] if "part" in row)
    box = leaf["bounds"]
    for nodes in (
        [{"bounds": box, "children": [1, 2]}, {"bounds": box, "children": [0, 2]}, leaf],
        [{"bounds": box, "children": [min(k + 1, 40), 2]} for k in range(40)] + [leaf, leaf],
        [{"bounds": box, "children": [1, 2]}, leaf, leaf, leaf],
        [{"bounds": box, "children": [0, 0]}],
    ):
        document = changed(document_of(folder), ("nodes",), nodes)
        (folder / "scene.json").write_text(json.dumps(document))
        with pytest.raises(SceneError, match="damaged"):
            load_occluder_tree(folder)


@pytest.mark.parametrize(
    "data", [b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b"7", b'{"schema_version":1}']
)
def test_what_is_no_manifest(folder, data):
    (folder / "scene.json").write_bytes(data)
    with pytest.raises(SceneError, match=r"scene\.json"):
        load_occluder_tree(folder)
    assert read_earlier(folder).summaries == {}


def test_every_truncation_is_refused(folder):
    data = (folder / "scene.json").read_bytes()
    for end in range(1, len(data), 997):
        (folder / "scene.json").write_bytes(data[:end])
        with pytest.raises(SceneError, match="not JSON"):
            load_occluder_tree(folder)
        assert read_earlier(folder).summaries == {}


def test_occluders_that_are_missing_or_changed(folder):
    path = next(
        folder / "occluders" / f"{row['near']}.glb"
        for row in document_of(folder)["nodes"]
        if "near" in row
    )
    for data in (path.read_bytes()[:300], path.read_bytes()[:-4] + b"0000", b"", None):
        path.unlink()
        if data is not None:
            path.write_bytes(data)
        with pytest.raises(SceneError, match=path.name):
            load_occluder_tree(folder)
        path.touch()


def test_no_build_and_nothing_made_by_looking_for_one(tmp_path):
    with pytest.raises(SceneError, match="there is no scene"):
        load_occluder_tree(tmp_path)
    assert read_earlier(tmp_path).summaries == {}
    assert list(tmp_path.iterdir()) == []


def test_keys_of_a_later_version_are_left_alone(folder):
    document = document_of(folder)
    document["author"] = "somebody"
    document["options"]["mood"] = "good"
    document["occluders"][min(document["occluders"])]["colour"] = "red"
    (folder / "scene.json").write_text(json.dumps(document))
    assert load_occluder_tree(folder).options == QUICK
    assert read_earlier(folder).summaries
