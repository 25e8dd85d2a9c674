"""What PLY files contain besides x y z and triangles."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.errors import UnreadableMeshError
from simplifier.io.ply import decode
from tests.io.builders import FACE_LIST, XYZ, ply

PATH = Path("mesh.ply")
POINTS = np.array(
    [
        [0, 0, 0],
        [2, 0, 0],
        [2, 2, 0],
        [0, 2, 0],
        [5, 0, 0],
        [7, 0, 0],
        [6, 1, 0],
        [7, 2, 0],
        [5, 2, 0],
    ],
    dtype=float,
)
TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "int64": "q", "uint64": "Q",
}  # fmt: skip
ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def pack(encoding: str, code: str, *values: float) -> bytes:
    if encoding == "ascii":
        return (" ".join(map(str, values)) + " ").encode()
    return struct.pack(ENCODINGS[encoding] + code, *values)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("item", TYPES)
@pytest.mark.parametrize("count", ["uchar", "int8", "ushort", "int", "uint32", "uint64"])
def test_every_whole_number_type_in_lists(encoding: str, item: str, count: str) -> None:
    header = f"element vertex 4\n{XYZ}element face 2\nproperty list {count} {item} vertex_index\n"
    body = b"".join(pack(encoding, "3f", *point) for point in POINTS[:4])
    body += pack(encoding, TYPES[count] + "3" + TYPES[item], 3, 0, 1, 2)
    body += pack(encoding, TYPES[count] + "4" + TYPES[item], 4, 3, 2, 1, 0)
    vertices, faces = decode(ply(header, body, encoding), PATH)
    np.testing.assert_array_equal(vertices, POINTS[:4])
    assert faces.tolist() == [[0, 1, 2], [3, 2, 1], [3, 1, 0]]


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("equal", [True, False], ids=["equal rows", "mixed rows"])
def test_extra_properties_and_elements_are_skipped(encoding: str, equal: bool) -> None:
    """Lists before, between and behind, in the vertices too, and a material element in front."""
    header = (
        "obj_info made by hand\nelement material 2\nproperty list uchar double shine\n"
        "property int id\n"
        "element vertex 4\nproperty uchar red\nproperty list uchar short tags\n"
        "property double x\nproperty double y\nproperty double z\nproperty float quality\n"
        "element face 2\nproperty list uchar float texcoord\nproperty uchar flags\n"
        "property list uchar int vertex_indices\nproperty list uchar float more\n"
        "element edge 1\nproperty int vertex1\nproperty int vertex2\n"
    )
    lengths = [1, 1] if equal else [1, 2]
    body = b""
    for length in lengths:
        body += pack(encoding, f"B{length}di", length, *[0.5] * length, 9)
    for row, point in enumerate(POINTS[:4]):
        length = lengths[row % 2]
        body += pack(encoding, f"BB{length}h3df", 255, length, *[-7] * length, *point, 0.25)
    for length, face in zip(lengths, ([0, 1, 2], [0, 2, 3]), strict=True):
        body += pack(encoding, f"B{length}f", length, *[0.5] * length)
        body += pack(encoding, f"BB3iB{length}f", 1, 3, *face, length, *[0.5] * length)
    body += pack(encoding, "2i", 0, 1)
    vertices, faces = decode(ply(header, body, encoding), PATH)
    np.testing.assert_array_equal(vertices, POINTS[:4])
    assert faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_faces_before_vertices_and_concave_polygons(encoding: str) -> None:
    header = f"element face 2\n{FACE_LIST}element vertex 9\n{XYZ}"
    body = pack(encoding, "B5i", 5, 4, 5, 6, 7, 8) + pack(encoding, "B3i", 3, 0, 1, 2)
    body += b"".join(pack(encoding, "3f", *point) for point in POINTS)
    vertices, faces = decode(ply(header, body, encoding), PATH)
    corners = vertices[faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2.0
    assert (areas > 0.0).all()
    assert areas[:-1].sum() == pytest.approx(3.0)  # a fan from the first corner would give more
    assert areas[-1] == 2.0


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_triangle_strips(encoding: str) -> None:
    strips = FACE_LIST.replace("uchar", "int")
    header = f"element vertex 9\n{XYZ}element tristrips 2\n{strips}"
    body = b"".join(pack(encoding, "3f", *point) for point in POINTS)
    body += pack(encoding, "9i", 8, 0, 1, 3, 2, -1, 4, 5, 6) + pack(encoding, "4i", 3, 6, 7, 8)
    _, faces = decode(ply(header, body, encoding), PATH)
    assert faces.tolist() == [[0, 1, 3], [3, 1, 2], [4, 5, 6], [6, 7, 8]]


def test_doubles_keep_every_digit() -> None:
    header = f"element vertex 1\n{XYZ.replace('float', 'double')}element face 0\n{FACE_LIST}"
    point = (5176000.1234567891, -0.1, 1e-300)
    vertices, _ = decode(ply(header, struct.pack("<3d", *point), "binary_little_endian"), PATH)
    assert tuple(vertices[0]) == point
    text = " ".join(map(repr, point)).encode()
    assert tuple(decode(ply(header, text), PATH)[0][0]) == point


@settings(max_examples=60, deadline=None)
@given(
    sizes=st.lists(st.integers(0, 9), max_size=40),
    encoding=st.sampled_from(sorted(ENCODINGS)),
    seed=st.integers(0, 2**32 - 1),
)
def test_mixed_sizes_match_a_plain_reader(sizes: list[int], encoding: str, seed: int) -> None:
    generator = np.random.default_rng(seed)
    # A convex outline in any order of reading: fans of it are right, and easy to list.
    angles = np.linspace(0.0, 2.0 * np.pi, 9, endpoint=False)
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(9)])
    header = f"element vertex 9\n{XYZ.replace('float', 'double')}"
    header += f"element face {len(sizes)}\n{FACE_LIST}"
    body = b"".join(pack(encoding, "3d", *point) for point in points.tolist())
    expected = []
    for size in sizes:
        face = np.sort(generator.permutation(9)[:size]).tolist()
        body += pack(encoding, f"B{size}i", size, *face)
        expected += [[face[0], face[k], face[k + 1]] for k in range(1, size - 1)]
    vertices, faces = decode(ply(header, body, encoding), PATH)
    np.testing.assert_array_equal(vertices, points)
    assert faces.tolist() == expected


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (f"element face 0\n{FACE_LIST}", "no element 'vertex'"),
        ("element vertex 1\nproperty float x\nproperty float y\n", "coordinate 'z'"),
        ("element vertex 1\nproperty list uchar float x\nproperty float y\n", "coordinate 'x'"),
        (f"element vertex 1\n{XYZ}property float x\n", "twice"),
        (f"element vertex 1\n{XYZ}element face 1\nproperty int a\n", "vertex_indices"),
        (
            f"element vertex 1\n{XYZ}element face 1\nproperty list int float vertex_indices\n",
            "whole",
        ),
        (f"element vertex -1\n{XYZ}", "not understood"),
        (f"element vertex 1\n{XYZ}property list float int a\n", "not understood"),
        ("element vertex 1\nproperty quad x\n", "not understood"),
        ("property float x\n", "not understood"),
        ("element vertex 9999999999999\n", "elements cannot be"),
        (f"element vertex 1\n{XYZ}element face 0\n{FACE_LIST}nonsense\n", "nonsense"),
    ],
)
def test_headers_that_cannot_be(header: str, message: str) -> None:
    with pytest.raises(UnreadableMeshError, match=message):
        decode(ply(header, b"0 0 0\n1 0\n"), PATH)


def test_a_comment_before_the_elements_may_lack_its_word() -> None:
    """Blender 2.47 wrote 'Created by Blender3D 247 - www.blender.org, source file: '."""
    header = f"Created by a program\nelement vertex 3\n{XYZ}element face 1\n{FACE_LIST}"
    vertices, faces = decode(ply(header, b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), PATH)
    assert vertices.tolist() == [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    assert faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("line", ["format ebcdic 1.0", "format"])
def test_unknown_encoding(line: str) -> None:
    with pytest.raises(UnreadableMeshError, match="not understood"):
        decode(f"ply\n{line}\nend_header\n".encode(), PATH)


@pytest.mark.parametrize(
    ("face", "message"),
    [
        ("3 0 1 9", "names vertex 9"),
        ("3 0 1 -1", "names vertex -1"),
        ("3 0 1 0.5", "0.5 is not the index"),
        ("3 0 1 nan", "not the index"),
        ("3 0 1 1e300", "not the index"),
        ("-3 0 1 2", "proper length"),
        ("nan 0 1 2", "proper length"),
        ("2.5 0 1 2", "proper length"),
        ("4 0 1 2", "truncated"),
        ("1e300 0 1 2", "proper length"),
        ("1e15 0 1 2", "truncated"),
        ("3 0 one 2", "line 11: 'one' is not a number"),
    ],
)
def test_damaged_text_faces(face: str, message: str) -> None:
    header = f"element vertex 3\n{XYZ}element face 1\n{FACE_LIST}"
    body = f"0 0 0 1 0 0 0 1 0\n{face}\n".encode()
    with pytest.raises(UnreadableMeshError, match=message):
        decode(ply(header, body), PATH)


def test_list_lengths_that_would_overflow() -> None:
    header = f"element vertex 1\n{XYZ}element face 2\nproperty list uint64 int vertex_indices\n"
    body = struct.pack("<3f", 0, 0, 0) + struct.pack("<QiQ", 1, 0, 2**64 - 1) + b"\0" * 8
    with pytest.raises(UnreadableMeshError, match="'face' 1 has a list without a proper length"):
        decode(ply(header, body, "binary_little_endian"), PATH)
    body = body.replace(b"\xff" * 8, struct.pack("<Q", 2**62))
    with pytest.raises(UnreadableMeshError, match="truncated"):
        decode(ply(header, body, "binary_little_endian"), PATH)


def test_header_with_windows_newlines_before_binary_data() -> None:
    """The data begin with a line feed: only the header's own line ending may be taken off."""
    header = ply(f"element vertex 3\n{XYZ}element face 1\n{FACE_LIST}", b"", "binary_little_endian")
    body = b"\x0a\x0a\x0a\x0a" + struct.pack("<8f", 0, 0, 1, 0, 0, 0, 1, 0)
    body += struct.pack("<B3i", 3, 0, 1, 2)
    expected = np.frombuffer(b"\x0a" * 4, "<f4")[0]
    for newline in (b"\n", b"\r\n", b"\r"):
        vertices, faces = decode(header.replace(b"\n", newline) + body, PATH)
        assert vertices[0, 0] == expected
        assert faces.tolist() == [[0, 1, 2]]
