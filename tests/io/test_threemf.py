"""3MF: what a model builds, out of which parts of the archive, and what is refused."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from simplifier.errors import EmptyMeshError, MemoryLimitError, UnreadableMeshError
from simplifier.geometry.overrides import Ignore, Pattern
from simplifier.io.load import claim_of, load
from simplifier.io.scene import load_scene
from tests.allocating import most_allocated
from tests.io.builders import (
    MODEL_3MF,
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    mesh_3mf,
    package_3mf,
    tetrahedron_3mf,
    zipped,
)

MESH = mesh_3mf(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
BODY = f'<object id="1" name="body">{MESH}</object>'
SHAPE = np.array(TETRAHEDRON_POINTS)[np.array(TETRAHEDRON_FACES)]
MOVED = 'transform="1 0 0 0 1 0 0 0 1 5 6 7"'
TURNED = 'transform="0 1 0 0 0 1 1 0 0 0 0 0"'  # x to y, y to z, z to x


def at(*place: float) -> np.ndarray:
    return np.array(place)


@pytest.fixture
def written(tmp_path: Path):
    def write(resources: str, build: str, **others: str) -> Path:
        path = tmp_path / "model.3mf"
        path.write_bytes(package_3mf(resources, build, **others))
        return path

    return write


def corners(path: Path) -> np.ndarray:
    mesh = load(path)
    return mesh.vertices[mesh.faces]


def test_items_stand_where_the_build_puts_them(written):
    build = f'<item objectid="1"/><item objectid="1" {MOVED}/><item objectid="1" {TURNED}/>'
    expected = [SHAPE, SHAPE + at(5, 6, 7), SHAPE[..., [2, 0, 1]]]
    np.testing.assert_array_equal(corners(written(BODY, build)), np.concatenate(expected))


def test_two_of_the_same_part_number_are_two(written):
    build = f'<item objectid="1" partnumber="M8"/><item objectid="1" partnumber="M8" {MOVED}/>'
    assert len(corners(written(BODY, build))) == 8


def test_what_is_not_built_is_not_there(written):
    other = BODY.replace('id="1"', 'id="2"')
    assert len(corners(written(BODY + other, '<item objectid="2"/>'))) == 4
    with pytest.raises(EmptyMeshError):
        load(written(BODY, ""))


def test_components_are_placed_within_what_they_make_up(written):
    pair = (
        f'<object id="2"><components><component objectid="1" {TURNED}/>'
        f'<component objectid="1" {MOVED}/></components></object>'
    )
    found = corners(written(BODY + pair, f'<item objectid="2" {MOVED}/>'))
    expected = [SHAPE[..., [2, 0, 1]] + at(5, 6, 7), SHAPE + at(10, 12, 14)]
    np.testing.assert_array_equal(found, np.concatenate(expected))


def test_objects_of_other_models_are_the_ones_that_are_meant(written):
    """Their numbers are their own, and a model can hold several."""
    small = mesh_3mf((0.5 * np.array(TETRAHEDRON_POINTS)).tolist(), TETRAHEDRON_FACES)
    part = MODEL_3MF.format(
        resources=f'<object id="1">{small}</object><object id="2">{MESH}</object>', build=""
    )
    pair = "".join(
        f'<component p:path="/3D/Part.model" objectid="{number}" {MOVED}/>' for number in (1, 2)
    )
    path = written(
        BODY + f'<object id="2"><components>{pair}</components></object>',
        '<item objectid="2"/><item objectid="1"/>', part=part,
    )  # fmt: skip
    expected = [0.5 * SHAPE + at(5, 6, 7), SHAPE + at(5, 6, 7), SHAPE]
    np.testing.assert_array_equal(corners(path), np.concatenate(expected))
    claim = claim_of(path)
    assert (claim.vertices, claim.triangles) == (12, 12)


def test_a_mirror_turns_the_winding(written):
    build = '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'
    found = corners(written(BODY, build))
    np.testing.assert_array_equal(found, (SHAPE * [-1, 1, 1])[:, ::-1])


MATERIALS = (
    '<basematerials id="7"><base name="wood" displaycolor="#804020"/>'
    '<base name="glass" displaycolor="#80A0FF40"/></basematerials>'
    '<m:colorgroup xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" id="8">'
    '<m:color color="#FFFFFFFF"/><m:color color="#FFFFFF80"/></m:colorgroup>'
)


@pytest.mark.parametrize(
    ("own", "triangle", "left"),
    [
        ("", "", 4),
        ('pid="7" pindex="0"', "", 4),
        ('pid="7" pindex="1"', "", 0),
        ('pid="7" pindex="0"', 'p1="1"', 3),
        ("", 'pid="7" p1="1"', 3),
        ('pid="7" pindex="1"', 'p1="0"', 1),
        ('pid="8" pindex="1"', 'pid="7" p1="0"', 1),
        ('pid="8" pindex="0"', "", 4),
        ('pid="9" pindex="0"', 'p1="77"', 4),
    ],
)
def test_what_one_can_see_through_is_left_out(written, own, triangle, left):
    mesh = MESH.replace('v3="2"/>', f'v3="2" {triangle}/>', 1)
    path = written(MATERIALS + f'<object id="1" {own}>{mesh}</object>', '<item objectid="1"/>')
    assert len(load(path, transparent="keep").faces) == 4
    if left:
        assert len(load(path).faces) == left
    else:
        with pytest.raises(EmptyMeshError, match=r"4 see-through .* 'glass'"):
            load(path)


def test_objects_and_materials_can_be_ignored(written):
    other = BODY.replace('id="1" name="body"', 'id="2" name="flag" pid="7" pindex="0"')
    path = written(MATERIALS + BODY + other, '<item objectid="1"/><item objectid="2"/>')
    assert len(load(path, ignore=Ignore(meshes=(Pattern("fl*", "here"),))).faces) == 4
    mesh = load(path, ignore=Ignore(materials=(Pattern("wood", "here"),)))
    assert [one.name for one in mesh.omitted] == ["material 'wood'"]


def test_objects_of_a_scene_share_their_mesh(written):
    scene = load_scene(written(BODY, f'<item objectid="1"/><item objectid="1" {MOVED}/>'))
    assert (scene.names, len(scene.meshes)) == (("body", "body.2"), 1)
    assert scene.transforms[1, :3, 3].tolist() == [5.0, 6.0, 7.0]


ITEM = '<item objectid="1"/>'
DEEP = "".join(
    f'<object id="{k}"><components><component objectid="{k + 1}"/><component objectid="{k + 1}"/>'
    "</components></object>"
    for k in range(2, 42)
)
CIRCLE = '<object id="2"><components><component objectid="2"/></components></object>'
ENTITIES = '<!DOCTYPE model [<!ENTITY a "0"><!ENTITY b "&a;&a;">]>\n<model'
DAMAGED = {
    "no model": (zipped({"readme.txt": "hello"}), "there is no model '3d/3dmodel.model'"),
    "encrypted": (
        tetrahedron_3mf().replace(b"PK\x01\x02\x14\x03\x14\0\0\0", b"PK\x01\x02\x14\x03\x14\0\1\0"),
        "is encrypted",
    ),
    "packed otherwise": (
        zipped({"3D/3dmodel.model": MODEL_3MF.format(resources=BODY, build=ITEM)},
               zipfile.ZIP_BZIP2),
        "packed in a way that 3MF does not have",
    ),
    "cut": (tetrahedron_3mf()[:-30], "damaged or cut off"),
    "another sum": (tetrahedron_3mf().replace(b"PK\x03\x04", b"PK\x03\x05", 1), "not a ZIP"),
    "entities": (
        zipped({"3D/3dmodel.model": MODEL_3MF.format(resources=BODY, build=ITEM).replace(
            "<model", ENTITIES, 1)}),
        "a document type (DOCTYPE)",
    ),
    "no such object": (package_3mf(BODY, '<item objectid="5"/>'), "there is no object '5'"),
    "no such part": (
        package_3mf('<object id="1"><components><component objectid="1" p:path="/3D/x.model"/>'
                    "</components></object>", ITEM),
        "there is no part '3d/x.model'",
    ),
    "a circle": (package_3mf(CIRCLE, '<item objectid="2"/>'), "nested in a circle"),
    "doubling": (
        package_3mf(BODY.replace('"1"', '"42"', 1) + DEEP, '<item objectid="2"/>'),
        "placed more than 100000",
    ),
    "twice a number": (package_3mf(BODY + BODY, ITEM), "two objects have the number '1'"),
    "no coordinate": (package_3mf(BODY.replace(' y="0.0"', "", 1), ITEM), "<vertex> has no 'y'"),
    "a word": (package_3mf(BODY.replace('y="0.0"', 'y="zero"', 1), ITEM), "<vertex>: could not"),
    "a corner out of range": (package_3mf(BODY.replace('v1="0"', 'v1="9"', 1), ITEM), "vertex 9"),
    "a short transform": (
        package_3mf(BODY, '<item objectid="1" transform="1 0 0"/>'), "<item>: cannot reshape",
    ),
    "an extension": (
        zipped({"3D/3dmodel.model": MODEL_3MF.format(resources=BODY, build=ITEM).replace(
            "unit=", 'requiredextensions="sc" xmlns:sc="http://x/securecontent/2019/04" unit=')}),
        "needs the extension 'http://x/securecontent/2019/04'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGED)
def test_what_cannot_be_read_is_refused_with_its_cause(tmp_path, name):
    data, said = DAMAGED[name]
    path = tmp_path / "model.3mf"
    path.write_bytes(data)
    with pytest.raises(UnreadableMeshError) as caught:
        load(path)
    assert said in str(caught.value)
    assert str(path) in str(caught.value)


def bomb(parts: int = 1, of: int = 80 << 20) -> bytes:
    """Blanks, which pack a thousand times smaller."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in range(parts):
            with archive.open("3D/3dmodel.model" if part == 0 else f"3D/{part}.model", "w") as one:
                one.write(b"<model>")
                for _ in range(of >> 20):
                    one.write(b" " * (1 << 20))
    return file.getvalue()


def test_an_archive_that_would_unpack_without_end_is_refused_by_its_directory(tmp_path):
    path = tmp_path / "bomb.3mf"
    path.write_bytes(bomb())

    def refuse():
        with pytest.raises(UnreadableMeshError, match="would unpack from"):
            load(path)

    assert most_allocated(refuse) < 1 << 20


def test_a_directory_that_lies_about_sizes_gains_nothing(tmp_path):
    data = bytearray(bomb(of=4 << 20))
    place = data.rindex(b"PK\x01\x02") + 24
    data[place : place + 4] = (100).to_bytes(4, "little")  # bytes, unpacked
    path = tmp_path / "lie.3mf"
    path.write_bytes(data)
    with pytest.raises(UnreadableMeshError, match="damaged or cut off"):
        load(path)


def test_too_many_parts_are_refused(tmp_path):
    path = tmp_path / "many.3mf"
    path.write_bytes(zipped({f"{k}": b"" for k in range(10_001)}, zipfile.ZIP_STORED))
    with pytest.raises(UnreadableMeshError, match="more than 10000 parts"):
        load(path)


def test_the_memory_is_estimated_before_the_model_is_read(written):
    path = written(BODY, ITEM * 7)
    claim = claim_of(path)
    assert (claim.vertices, claim.triangles) == (28, 28)
    with pytest.raises(MemoryLimitError, match="to load the mesh"):
        load(path, memory_limit=1e-6)


@pytest.mark.parametrize("text", [MESH.replace("<vertex ", "<vertex\n"), MESH * 9])
def test_elements_that_are_written_otherwise_are_no_way_around_the_estimate(written, text):
    path = written(f'<object id="1">{text}</object>', ITEM)
    mesh = load(path)
    held = 24 * (len(mesh.vertices) + len(mesh.faces))
    assert claim_of(path).decoding > held + len(text)


def test_what_trimesh_writes_is_read_as_it_was(tmp_path):
    pytest.importorskip("lxml")
    ball = trimesh.creation.icosphere(2)
    scene = trimesh.Scene()
    scene.add_geometry(ball, transform=trimesh.transformations.translation_matrix([3, 0, 0]))
    scene.add_geometry(trimesh.creation.box(), transform=np.diag([2.0, 2.0, 2.0, 1.0]))
    path = tmp_path / "both.3mf"
    path.write_bytes(scene.export(file_type="3mf"))
    ours, theirs = corners(path), trimesh.load(path, force="mesh", process=False).triangles
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert len(ours) == len(ball.faces) + 12
