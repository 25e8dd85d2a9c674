"""The statements of Wavefront OBJ, and a plain reader to compare with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.errors import UnreadableMeshError
from simplifier.io.obj import decode

PATH = Path("mesh.obj")
SQUARE = b"v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"


def faces_of(text: bytes) -> list[list[int]]:
    return decode(SQUARE + text, PATH)[1].tolist()


@pytest.mark.parametrize(
    "statement",
    [
        b"f 1 2 3",
        b"f 1/1 2/2 3/3",
        b"f 1//1 2//2 3//3",
        b"f 1/1/1 2/2/2 3/3/3",
        b"f 1/ 2/ 3/",
        b"f -4 -3 -2",
        b"f -4/-1/-1 -3/-1/-1 -2/-1/-1",
        b"  f   1\t2  3  ",
        b"F 1 2 3",
        b"f +1 2 3",
        b"f 1 2 \\\n3",
        b"f 1 2\\\n 3",
        b"f 1 \\\r\n2 \\\r3",
        b"f 1 2 3 # the only one",
        b"f 1 2 3 #",
        b"# a folder C:\\models\\\nf 1 2 3",
        b"f 1 2 3\nusemtl f\ng f 1 2 3\nvt 0 0\nvn 0 0 1\nl 1 2\np 1\ns off",
        b"f 1 2 3\nf 1 2\nf 1\nf",
        b"mtllib \xe9\xff.mtl\nf 1 2 3",
    ],
)
def test_one_triangle(statement: bytes) -> None:
    assert faces_of(statement) == [[0, 1, 2]]
    assert faces_of(statement + b"\n") == [[0, 1, 2]]


def test_relative_indices_count_from_where_they_stand() -> None:
    text = SQUARE + b"f -4 -3 -2\nv 9 9 9\nf -3 -2 -1\n"
    assert decode(text, PATH)[1].tolist() == [[0, 1, 2], [2, 3, 4]]


def test_polygons_are_triangulated() -> None:
    assert faces_of(b"f 1 2 3 4") == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    "line", [b"v 1 2 3 0.5", b"v 1 2 3 255 0 0", b"v\t1\t2\t3", b"V 1 2 3", b"  v 1. +2 3e0"]
)
def test_vertex_forms(line: bytes) -> None:
    assert decode(line, PATH)[0].tolist() == [[1.0, 2.0, 3.0]]


def test_other_statements_that_begin_alike() -> None:
    vertices, faces = decode(b"vt 1 2 3\nvn 1 2 3\nvp 1 2 3\nfo 1 2 3\nfoo\nv 1 2 3\n", PATH)
    assert (len(vertices), len(faces)) == (1, 0)


@pytest.mark.parametrize(
    ("word", "value"),
    [(b"1.#INF", np.inf), (b"-1.#IND", np.nan), (b"1.#QNAN0", np.nan), (b"nan", np.nan)],
)
def test_words_for_no_number(word: bytes, value: float) -> None:
    np.testing.assert_array_equal(decode(b"v " + word + b" 0 0", PATH)[0][0], [value, 0.0, 0.0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"v 0 0\n", "line 1: 'v' needs 3 numbers"),
        (b"v 0 0 0\r\n\r\nv 0 0 # 0\r\n", "line 3: 'v' needs 3 numbers"),
        (b"v 0 0 0\nv 0 zero 0\n", "line 2: 'zero' is not a number"),
        (b"v 1_0 0 0\n", "'1_0' is not a number"),
        (b"v 0x10 0 0\n", "'0x10' is not a number"),
        (SQUARE + b"f 1 2 0\n", "line 5: '0' is not the index"),
        (SQUARE + b"f 1 2 x\n", "line 5: 'x' is not the index"),
        (SQUARE + b"f 1 2 /3\n", "line 5: '/3' is not the index"),
        (SQUARE + b"f 1 2 1.5\n", "'1.5' is not the index"),
        (SQUARE + b"f 1 2 -\n", "'-' is not the index"),
        (SQUARE + b"f 1 2 5\n", "face 0 names vertex 4"),
        (SQUARE + b"f 1 2 -5\n", "face 0 names vertex -1"),
        (SQUARE + b"f 1 2 3\nf 1 2 9007199254740991\n", "face 1 names vertex"),
        (SQUARE + b"f 1 2 99999999999999999999999\n", "is not the index"),
        (b"newmtl red\nKd 1 0 0\n", "no vertex and no face"),
    ],
)
def test_damage_is_named(text: bytes, message: str) -> None:
    with pytest.raises(UnreadableMeshError, match=message):
        decode(text, PATH)


def plain_decode(text: str) -> tuple[list[list[float]], list[list[int]]]:
    """The same by splitting lines."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for line in text.replace("\\\n", " ").splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            found = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([one - 1 if one > 0 else len(vertices) + one for one in found])
    return vertices, faces


numbers = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.decimals(-1000, 1000, places=4, allow_nan=False).map(str),
    st.integers(-(10**6), 10**6).map(str),
)


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_same_as_the_plain_reader(data: st.DataObject) -> None:
    lines, count = [], 0
    gap = st.sampled_from([" ", "  ", "\t", " \\\n "])
    for _ in range(data.draw(st.integers(1, 30))):
        kind = data.draw(st.sampled_from("vvf#n"))
        if kind == "v" or count < 3:
            words = ["v", *data.draw(st.lists(numbers, min_size=3, max_size=6))]
            count += 1
        elif kind == "f":
            tail = data.draw(st.sampled_from(["", "/1", "//2", "/1/2"]))
            index = st.one_of(st.integers(1, count), st.integers(-count, -1))
            words = ["f", *[f"{data.draw(index)}{tail}" for _ in range(3)]]
        else:
            words = data.draw(st.sampled_from([["# v 1 2 3"], ["vn", "0", "0", "1"], [""]]))
        lines.append(data.draw(gap).join(words))
    text = "\n".join(lines)
    vertices, faces = decode(text.encode(), PATH)
    expected = plain_decode(text)
    assert vertices.tolist() == expected[0]
    assert faces.tolist() == expected[1]
