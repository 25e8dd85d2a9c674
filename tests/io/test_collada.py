"""COLLADA: what stands where, what it is made of, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from simplifier.errors import MemoryLimitError, OverridesError, UnreadableMeshError
from simplifier.geometry.overrides import Ignore, Pattern
from simplifier.io.load import claim_of, load
from simplifier.io.scene import load_scene
from tests.io.builders import (
    FAN,
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    collada,
    geometry_dae,
    tetrahedron_dae,
    triangles_dae,
)

BODY = geometry_dae("body", TETRAHEDRON_POINTS, triangles_dae("body", TETRAHEDRON_FACES))
HERE = '<instance_geometry url="#body"/>'
L_SHAPE = [[2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 0, 0]]


def at(*place: float) -> np.ndarray:
    return np.array(place)


def node(inside: str, name: str = "") -> str:
    return f'<node id="{name}">{inside}</node>' if name else f"<node>{inside}</node>"


@pytest.fixture
def written(tmp_path: Path):
    def write(nodes: str, geometries: str = BODY, libraries: str = "") -> Path:
        path = tmp_path / "scene.dae"
        path.write_bytes(collada(geometries, nodes, libraries))
        return path

    return write


def corners(path: Path) -> np.ndarray:
    mesh = load(path)
    return mesh.vertices[mesh.faces]


SHAPE = np.array(TETRAHEDRON_POINTS)[np.array(TETRAHEDRON_FACES)]


@pytest.mark.parametrize(
    ("transforms", "moved"),
    [
        ("<translate>1 2 3</translate><scale>2 2 2</scale>", lambda p: 2.0 * p + at(1, 2, 3)),
        ("<scale>2 2 2</scale><translate>1 2 3</translate>", lambda p: 2.0 * (p + at(1, 2, 3))),
        ("<rotate>0 0 2 90</rotate>", lambda p: p[..., [1, 0, 2]] * [-1, 1, 1]),
        ("<rotate>0 0 0 90</rotate>", lambda p: p),
        (
            "<matrix>0 0 1 5 1 0 0 6 0 1 0 7 0 0 0 1</matrix>",
            lambda p: p[..., [2, 0, 1]] + at(5, 6, 7),
        ),
        ("<lookat>0 0 9 0 0 0 0 1 0</lookat>", lambda p: p + at(0, 0, 9)),
        (
            "<lookat>9 0 0 0 0 0 0 1 0</lookat>",
            lambda p: p[..., [2, 1, 0]] * [1, 1, -1] + at(9, 0, 0),
        ),
    ],
)
def test_transforms_apply_from_the_innermost_out(written, transforms, moved):
    np.testing.assert_allclose(corners(written(node(transforms + HERE))), moved(SHAPE), atol=1e-15)


def test_nodes_within_nodes_and_those_of_the_library(written):
    kept = f"<library_nodes>{node('<translate>0 0 1</translate>' + HERE, 'kept')}</library_nodes>"
    nodes = node("<translate>5 0 0</translate>" + node(HERE) + '<instance_node url="#kept"/>')
    found = corners(written(nodes, libraries=kept))
    np.testing.assert_array_equal(found, np.concatenate([SHAPE + at(5, 0, 0), SHAPE + at(5, 0, 1)]))


def test_far_away_places_keep_their_digits(written):
    nodes = node("<translate>5176000.125 390000.0625 512.5</translate>" + HERE)
    np.testing.assert_array_equal(
        corners(written(nodes)), SHAPE + at(5176000.125, 390000.0625, 512.5)
    )


def test_a_mirror_turns_the_winding(written):
    found = corners(written(node("<scale>-1 1 1</scale>" + HERE)))
    np.testing.assert_array_equal(found, (SHAPE * [-1, 1, 1])[:, ::-1])


def test_a_skin_stands_where_it_was_bound(written):
    skin = (
        '<library_controllers><controller id="skin"><skin source="#body"><bind_shape_matrix>'
        "1 0 0 4 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller>"
        "</library_controllers>"
    )
    nodes = node('<translate>9 9 9</translate><instance_controller url="#skin"/>')
    np.testing.assert_array_equal(corners(written(nodes, libraries=skin)), SHAPE + at(4, 0, 0))


def faces_of(written, kind: str, lists: str, points=FAN, more: str = "") -> np.ndarray:
    inputs = (
        '<input semantic="NORMAL" source="#fan-positions" offset="0"/>'
        '<input semantic="VERTEX" source="#fan-vertices" offset="1"/>'
    )
    body = f"<{kind}>{inputs}{more}{lists}</{kind}>"
    return corners(
        written(node('<instance_geometry url="#fan"/>'), geometry_dae("fan", points, body))
    )


@pytest.mark.parametrize(
    ("kind", "lists", "expected"),
    [
        ("triangles", "<p>9 0 9 1 9 2</p><p>9 0 9 2 9 3</p>", [[0, 1, 2], [0, 2, 3]]),
        ("tristrips", "<p>9 0 9 1 9 2 9 3</p>", [[0, 1, 2], [2, 1, 3]]),
        ("trifans", "<p>9 0 9 1 9 2 9 3</p>", [[0, 1, 2], [0, 2, 3]]),
        ("polygons", "<p>9 0 9 1 9 2 9 3</p><p>9 0 9 3 9 4</p>", [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
        ("polylist", "<vcount>4 3</vcount><p>9 0 9 1 9 2 9 3 9 0 9 3 9 4</p>",
         [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
    ],
)  # fmt: skip
def test_every_kind_of_face_becomes_triangles(written, kind, lists, expected):
    np.testing.assert_array_equal(faces_of(written, kind, lists), np.array(FAN)[np.array(expected)])


def test_a_polygon_that_is_not_convex_covers_no_more_than_it_should(written):
    indices = " ".join(f"0 {place}" for place in range(6))
    found = faces_of(written, "polygons", f"<p>{indices}</p>", L_SHAPE)
    areas = np.linalg.norm(np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]), axis=1)
    assert areas.sum() / 2.0 == pytest.approx(3.0)


GLASS = (
    '<library_materials><material id="pane" name="glass"><instance_effect url="#clear"/>'
    "</material></library_materials><library_effects><effect id=\"clear\"><profile_COMMON>"
    "<technique><phong>{}</phong></technique></profile_COMMON></effect></library_effects>"
)  # fmt: skip
BOUND = (
    '<instance_geometry url="#body"><bind_material><technique_common><instance_material'
    ' symbol="stone" target="#pane"/></technique_common></bind_material></instance_geometry>'
)


@pytest.mark.parametrize(
    ("words", "see_through"),
    [
        ("", False),
        ("<transparency><float>0.5</float></transparency>", False),
        ('<transparent opaque="A_ONE"><color>1 1 1 1</color></transparent>', False),
        ("<transparent><color>1 1 1 0.4</color></transparent>", True),
        (
            "<transparent><color>1 1 1 1</color></transparent>"
            "<transparency><float>0.3</float></transparency>",
            True,
        ),
        ('<transparent opaque="RGB_ZERO"><color>0 0 0 1</color></transparent>', False),
        ('<transparent opaque="RGB_ZERO"><color>0.5 0.5 0.5 1</color></transparent>', True),
        ('<transparent><texture texture="leaf" texcoord="UV"/></transparent>', True),
    ],
)
def test_what_one_can_see_through_is_left_out(written, words, see_through):
    path = written(node(BOUND + "<node><translate>5 0 0</translate>" + HERE + "</node>"),
                   libraries=GLASS.format(words))  # fmt: skip
    mesh = load(path)
    assert len(mesh.faces) == (4 if see_through else 8)
    assert [one.name for one in mesh.omitted] == (["material 'glass'"] if see_through else [])
    assert len(load(path, transparent="keep").faces) == 8


def test_nodes_meshes_and_materials_can_be_ignored(written):
    nodes = node(HERE, "wall") + node("<translate>9 0 0</translate>" + HERE, "flag")
    path = written(nodes)
    for pattern, kept in (("flag", 4), ("fl*", 4), ("body", None)):
        ignore = Ignore(meshes=(Pattern(pattern, "here"),))
        if kept is None:
            with pytest.raises(Exception, match="nothing opaque is left"):
                load(path, ignore=ignore)
        else:
            assert len(load(path, ignore=ignore).faces) == kept
    with pytest.raises(OverridesError, match="the file has 'stone'"):
        load(path, ignore=Ignore(materials=(Pattern("wood", "here"),)))


def test_objects_of_a_scene_share_their_mesh(written):
    nodes = node(HERE, "wall") + node("<translate>9 0 0</translate>" + HERE, "flag")
    scene = load_scene(written(nodes))
    assert (scene.names, len(scene.meshes)) == (("wall", "flag"), 1)
    assert scene.transforms[1, :3, 3].tolist() == [9.0, 0.0, 0.0]


DAMAGED = {
    "no COLLADA": b"<?xml version='1.0'?><svg/>",
    "entities": tetrahedron_dae().replace(
        b"<COLLADA", b'<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>\n<COLLADA', 1
    ),
    "an external entity": tetrahedron_dae().replace(
        b"<COLLADA", b'<!DOCTYPE x SYSTEM "file:///etc/passwd">\n<COLLADA', 1
    ),
    "another mesh file": tetrahedron_dae().replace(b'url="#body"', b'url="other.dae#body"'),
    "no such mesh": tetrahedron_dae().replace(b'url="#body"', b'url="#bady"'),
    "a circle": collada(BODY, '<node id="a"><instance_node url="#a"/></node>'),
    "a skew": collada(BODY, node("<skew>1 2 3 4 5 6 7</skew>" + HERE)),
    "a short matrix": collada(BODY, node("<matrix>1 0 0</matrix>" + HERE)),
    "fewer numbers": tetrahedron_dae().replace(b'count="12"', b'count="15"'),
    "words": tetrahedron_dae().replace(b"0.0 0.0 0.0 1.0", b"0.0 zero 0.0 1.0"),
    "fewer faces": tetrahedron_dae().replace(b'triangles count="4"', b'triangles count="5"'),
    "a corner out of range": tetrahedron_dae().replace(b"<p>0 2", b"<p>0 9"),
    "half a triangle": tetrahedron_dae().replace(b"<p>0 2 1", b"<p>2 1"),
    "a hole": collada(
        geometry_dae("body", FAN, '<polygons><input semantic="VERTEX" source="#body-vertices"'
                     ' offset="0"/><ph><p>0 1 2 3</p><h>0 1 2</h></ph></polygons>'),
        node(HERE),
    ),
    "too deep": b"<COLLADA>" + b"<a>" * 300 + b"</a>" * 300 + b"</COLLADA>",
    "a rare encoding": tetrahedron_dae().replace(b'encoding="utf-8"', b'encoding="utf-7"'),
    "cut": tetrahedron_dae()[:-20],
}  # fmt: skip
SAID = {
    "no COLLADA": "the XML is a <svg>",
    "entities": "line 2: a document type",
    "an external entity": "document type",
    "another mesh file": "another file, 'other.dae#body'",
    "no such mesh": "refers to '#bady'",
    "a circle": "in a circle",
    "a skew": "skewed",
    "a short matrix": "<matrix> has 3 numbers instead of 16",
    "fewer numbers": "promised 15 numbers, and 12",
    "words": "<float_array> holds something else than numbers",
    "fewer faces": "promised 5 faces, and 4",
    "a corner out of range": "face 0 names vertex 9",
    "half a triangle": "has 11 corners",
    "a hole": "polygons with holes",
    "too deep": "nest deeper than 200",
    "a rare encoding": "its encoding is 'utf-7'",
    "cut": "damaged or cut off in line",
}


@pytest.mark.parametrize("name", DAMAGED)
def test_what_cannot_be_read_is_refused_with_its_cause(tmp_path, name):
    path = tmp_path / "scene.dae"
    path.write_bytes(DAMAGED[name])
    with pytest.raises(UnreadableMeshError) as caught:
        load(path)
    assert SAID[name] in str(caught.value)
    assert str(path) in str(caught.value)
    assert claim_of(path).decoding < 1 << 20


def test_nodes_that_double_and_double_are_refused_at_once(tmp_path):
    kept = "".join(
        f'<node id="n{k}"><instance_node url="#n{k + 1}"/><instance_node url="#n{k + 1}"/></node>'
        for k in range(60)
    )
    libraries = f"<library_nodes>{kept}{node(HERE, 'n60')}</library_nodes>"
    path = tmp_path / "bomb.dae"
    path.write_bytes(collada(BODY, node('<instance_node url="#n0"/>'), libraries))
    with pytest.raises(UnreadableMeshError, match="placed more than"):
        load(path)


def test_the_memory_is_estimated_before_the_tree_is_built(written):
    path = written(node(HERE) * 3 + f"<!--{'x' * 200_000}-->")
    claim = claim_of(path)
    assert (claim.vertices, claim.triangles) == (12, 12)
    with pytest.raises(MemoryLimitError, match="to load the mesh"):
        load(path, memory_limit=1e-6)


def test_what_trimesh_writes_is_read_as_it_was(tmp_path):
    pytest.importorskip("collada")
    ball = trimesh.creation.icosphere(2).apply_translation([3.0, 0.0, 0.0])
    box = trimesh.creation.box()
    path = tmp_path / "both.dae"
    path.write_bytes(trimesh.exchange.dae.export_collada([ball, box]))
    expected = np.concatenate([ball.triangles, box.triangles])
    np.testing.assert_allclose(corners(path), expected, atol=1e-6)
    theirs = trimesh.load(path, force="mesh", process=False)
    np.testing.assert_allclose(corners(path), theirs.triangles, atol=1e-6)
