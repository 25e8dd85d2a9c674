"""The small formats: their variants and their damages."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import UnreadableMeshError
from simplifier.io import off, stl, tres
from tests.io.builders import binary_stl, tetrahedron, text_off, text_stl, text_tres

PATH = Path("mesh")

# OFF

OFF_BODY = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n4 1 0\n" + OFF_BODY,
        "OFF 4 1 0\n" + OFF_BODY,
        "OFF4 1 0\n" + OFF_BODY,
        " \t  COFF4 1 0 # glued\n" + OFF_BODY,
        "off\n4 1\n" + OFF_BODY,
        "# made\n\n  # by hand\nOFF # here\n# counts\n4 1 0 # four\n\n" + OFF_BODY,
        "OFF\n4 1 0\n" + OFF_BODY.replace("\n", " # remark\n\n"),
        "COFF\n4 1 0\n" + OFF_BODY.replace(" 0\n", " 0 255 0 0 255\n"),
        "NOFF\n4 1 0\n" + OFF_BODY.replace(" 0\n", " 0 0 0 1\n"),
        "STCNOFF\n4 1 0\n" + OFF_BODY,
        "OFF\n4 1 0\n" + OFF_BODY.replace("2 3\n", "2 3 0.5 0.5 0.5\n"),
        "OFF\n4 1 0\n" + OFF_BODY.replace("2 3\n", "2 3 7\n"),
        "OFF\n4 1 0\n" + OFF_BODY + "and more, which nobody promised 1\n".replace("and", "# and"),
    ],
)
def test_off_variants(text: str) -> None:
    vertices, faces = off.decode(text.encode(), PATH)
    assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("4OFF\n1 0 0\n0 0 0 1\n", "4OFF"),
        ("nOFF\n3\n1 0 0\n0 0 0\n", "nOFF"),
        ("OFF BINARY\n\0\0\0\1", "binary OFF"),
        ("4 1 0\n" + OFF_BODY, "does not begin with OFF"),
        ("OFFICE 4 1 0\n" + OFF_BODY, "does not begin with OFF"),
        ("OFF", "counts"),
        ("OFF\n4\n" + OFF_BODY, "counts"),
        ("OFF\n-4 1 0\n" + OFF_BODY, "-4 is not a count"),
        ("OFF\nnan 1 0\n" + OFF_BODY, "nan is not a count"),
        ("OFF\n4 1.5 0\n" + OFF_BODY, "1.5 is not a count"),
        ("OFF\n4 1e300 0\n" + OFF_BODY, "not a count"),
        ("OFF\n4 2000000000 0\n" + OFF_BODY, "truncated"),
        ("OFF\n4 2 0\n" + OFF_BODY, "truncated"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("1 1 0", "1 1"), "vertex 2 has fewer"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("2 3\n", "2\n"), "face 0 promises 4"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("4 0", "-4 0"), "face 0 promises -4"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("4 0", "nan 0"), "face 0 promises nan"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("2 3\n", "2 4\n"), "names vertex 4"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("2 3\n", "2 0.5\n"), "0.5 is not a vertex"),
        ("OFF\n4 1 0\n" + OFF_BODY.replace("1 1 0", "1 one 0"), "line 5: 'one'"),
    ],
)
def test_damaged_off(text: str, message: str) -> None:
    with pytest.raises(UnreadableMeshError, match=message):
        off.decode(text.encode(), PATH)


def test_many_blank_lines_before_off_take_linear_time() -> None:
    with pytest.raises(UnreadableMeshError):
        off.decode(b"\n" * 100_000 + b"ON", PATH)


# STL


@pytest.mark.parametrize("header", [b"solid made by a tool", b"\0", b"solid x\nfacet normal"])
def test_binary_stl_whatever_its_header(header: bytes) -> None:
    data = binary_stl(header)
    for content in (data, data + b"spare"):
        vertices, faces = stl.decode(content, PATH)
        assert faces.tolist() == np.arange(12).reshape(4, 3).tolist()
        assert vertices[:3].tolist() == [[0, 0, 0], [0, 1, 0], [1, 0, 0]]


def test_truncated_binary_stl() -> None:
    for data in (binary_stl()[:-1], binary_stl()[:84], binary_stl(b"solid x")[:-1]):
        with pytest.raises(UnreadableMeshError, match="promise 4 triangles, 284 bytes"):
            stl.decode(data, PATH)
    with pytest.raises(UnreadableMeshError, match="truncated"):
        stl.decode(b"\0" * 83, PATH)


def test_a_count_of_billions_allocates_nothing() -> None:
    data = b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50
    with pytest.raises(UnreadableMeshError, match="4294967295"):
        stl.decode(data, PATH)


@pytest.mark.parametrize(
    "change",
    [
        bytes.upper,
        lambda data: data.replace(b"  ", b"\t"),
        lambda data: data + data.replace(b"tetrahedron", b"second"),
        lambda data: b"\n  " + data,
        lambda data: data.replace(b"endsolid tetrahedron", b"end solid"),
        lambda data: data.replace(b"solid tetrahedron", b"solid a vertex facet 1 2 3"),
    ],
)
def test_text_stl_variants(change) -> None:
    vertices, faces = stl.decode(change(text_stl()), PATH)
    assert len(faces) in (4, 8)
    assert vertices[:3].tolist() == [[0, 0, 0], [0, 1, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"endsolid tetrahedron\n", b"", "truncated"),
        (b"vertex 0.0 0.0 1.0\n", b"\n", "4 facets have"),
        (b"vertex 0.0 0.0 1.0\n", b"vertex 0.0 0.0\n", "'vertex' needs 3"),
        (b"vertex 0.0 0.0 1.0\n", b"vertex 0.0 0.0 l.0\n", "'l.0' is not a number"),
    ],
)
def test_damaged_text_stl(old: bytes, new: bytes, message: str) -> None:
    assert old in text_stl()
    with pytest.raises(UnreadableMeshError, match=message):
        stl.decode(text_stl().replace(old, new), PATH)


def test_stl_without_facets() -> None:
    for data in (b"solid x\nendsolid x\n", b"\0" * 84):
        assert stl.decode(data, PATH)[1].shape == (0, 3)


# Godot


def test_tres_on_several_lines_and_without_arrays() -> None:
    spread = text_tres().replace(b", ", b",\n")
    assert len(tres.decode(spread, PATH)[1]) == 4
    empty = b'[gd_resource type="ArrayOccluder3D" format=3]\n\n[resource]\n'
    assert tres.decode(empty, PATH)[1].shape == (0, 3)


def test_tres_words_for_infinity() -> None:
    text = text_tres().replace(b"(0.0, 0.0", b"(inf_neg, nan")
    assert tres.decode(text, PATH)[0][0, 0] == -np.inf


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"ArrayOccluder3D", b"BoxOccluder3D", "found: BoxOccluder3D"),
        (b"[gd_resource", b"[gd_scene", "not a Godot"),
        (b"0, 2, 1, ", b"0, 2, ", "'indices' is not a whole number of triples"),
        (b"(0.0, 0.0, 0.0, ", b"(0.0, ", "'vertices' is not a whole number of triples"),
        (b"0, 2, 1, ", b"0, 2, 1.5, ", "other than whole"),
        (b"0, 2, 1, ", b"0, 2, 4, ", "names vertex 4"),
        (b"0, 2, 1, ", b"0, 2, -1, ", "names vertex -1"),
        (b"0, 2, 1, ", b"0, two, 1, ", "'two' is not a number"),
        (b")\nindices", b"\nindices", "truncated inside 'vertices'"),
        (b"PackedInt32Array", b"PackedInt64Array", "'indices' is not a PackedInt32Array"),
    ],
)
def test_damaged_tres(old: bytes, new: bytes, message: str) -> None:
    assert old in text_tres()
    with pytest.raises(UnreadableMeshError, match=message):
        tres.decode(text_tres().replace(old, new), PATH)


def test_written_tres_is_what_godot_expects() -> None:
    lines = tres.encode(tetrahedron()).decode().splitlines()
    assert len(lines) == 5
    assert lines[0] == '[gd_resource type="ArrayOccluder3D" format=3]'
    assert lines[2] == "[resource]"
    points = "0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0"
    assert lines[3] == f"vertices = PackedVector3Array({points})"
    assert lines[4] == "indices = PackedInt32Array(0, 1, 2, 0, 2, 3, 2, 1, 3, 0, 3, 1)"


def test_text_off_builder_is_read() -> None:
    assert len(off.decode(text_off(), PATH)[1]) == 4
