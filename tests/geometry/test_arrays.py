"""Arrays of every kind that a caller may hand over: taken as they are meant, or refused."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from simplifier.errors import MeshError
from simplifier.geometry.arrays import cross_products, face_array, vertex_array

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])

VERTICES = {
    "float16": SQUARE.astype(np.float16),
    "long double": SQUARE.astype(np.longdouble),
    "big-endian": SQUARE.astype(">f4"),
    "uint64": SQUARE.astype(np.uint64),
    "fortran": np.asfortranarray(SQUARE),
    "every second row": np.repeat(SQUARE, 2, axis=0)[::2],
    "turned around": SQUARE[::-1, ::-1][::-1, ::-1],
    "lists": SQUARE.tolist(),
    "tuples": tuple(map(tuple, SQUARE.tolist())),
    "python's numbers": [[0, Fraction(0), 0], [1, 0.0, 0], [1, 1, 0], [0, True + 0, 0]],
    "masked, nothing of it": np.ma.masked_array(SQUARE, mask=False),
}


@pytest.mark.parametrize("name", VERTICES)
def test_vertices_of_any_real_kind(name):
    values = vertex_array(VERTICES[name], "")
    assert values.dtype == np.float64
    assert values.tolist() == SQUARE.tolist()


def test_a_read_only_array_is_taken_without_a_copy():
    given = SQUARE.astype(np.float64)
    given.setflags(write=False)
    assert vertex_array(given, "") is given


@pytest.mark.parametrize("kind", [np.int8, np.uint16, ">i4", np.uint64, np.float32, object])
def test_faces_of_any_kind_that_holds_whole_numbers(kind):
    values = face_array(FACES.astype(kind), 4, "")
    assert values.dtype == np.int64
    assert values.tolist() == FACES.tolist()


NO_NUMBERS = {
    "text": [["0", "0", "0"]],
    "bytes": np.array([[b"0", b"0", b"0"]]),
    "complex": SQUARE.astype(complex),
    "truth": SQUARE.astype(bool),
    "times": np.zeros((4, 3), "datetime64[s]"),
    "records": np.zeros(4, [("x", "f8"), ("y", "f8"), ("z", "f8")]),
    "none": [[None, 0, 0]],
    "decimals": [[Decimal(1), 0, 0]],
    "objects": np.array([[object()] * 3]),
    "a mapping": {"x": 1},
    "a word": "vertices",
    "nothing": None,
    "rows of two lengths": [[0, 0, 0], [1, 0]],
    "masked": np.ma.masked_array(SQUARE, mask=SQUARE == 1),
}


@pytest.mark.parametrize("name", NO_NUMBERS)
def test_what_holds_no_real_numbers_is_refused(name):
    with pytest.raises(MeshError, match=r"^scene: vertices .*; pass an array of real numbers$"):
        vertex_array(NO_NUMBERS[name], "scene")
    with pytest.raises(MeshError, match=r"^scene: faces .*; pass an array of real numbers$"):
        face_array(NO_NUMBERS[name], 4, "scene")


def test_a_whole_number_beyond_all_floats():
    with pytest.raises(MeshError, match="beyond all floats"):
        vertex_array([[10**400, 0, 0]], "")


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (np.zeros((4, 2)), r"shape \(4, 2\)"),
        (np.zeros((2, 4, 3)), r"shape \(2, 4, 3\)"),
        (5.0, r"shape \(1, 1\)"),
        (np.broadcast_to(np.zeros(3), (2**31, 3)), "2147483648 vertices"),
    ],
)
def test_vertices_of_a_wrong_shape(vertices, words):
    with pytest.raises(MeshError, match=words):
        vertex_array(vertices, "")


@pytest.mark.parametrize(
    ("faces", "words"),
    [
        ([[0, 1, 2, 3]], r"faces have shape \(1, 4\)"),
        ([0, 1], r"faces have shape \(1, 2\)"),
        ([[0, 1, 4]], "face 0 names vertex 4, but there are 4 vertices"),
        ([[0, 1, 2], [-1, 1, 2]], "face 1 names vertex -1"),
        ([[0, 1, 0.5]], "names vertex 0.5"),
        ([[0, 1, float("nan")]], "names vertex nan"),
        ([[0, 1, float("inf")]], "names vertex inf"),
        ([[0, 1, 2**64]], "names vertex 18446744073709551616"),
        (np.array([[0, 1, 2**64 - 1]], np.uint64), "names vertex 18446744073709551615"),
        (np.array([[0, 1, 2**32]], np.int64), "names vertex 4294967296"),
        (np.array([[0, 1, -(2**63)]], np.int64), "names vertex -9223372036854775808"),
    ],
)
def test_faces_that_name_no_vertex(faces, words):
    """A cast to int64 would turn 2**64 - 1 into the last vertex of Python, and 0.5 into 0."""
    with pytest.raises(MeshError, match=words):
        face_array(faces, 4, "")


@pytest.mark.parametrize("empty", [[], (), np.empty((0, 3)), np.empty((0, 7)), np.empty((3, 0))])
def test_nothing_at_all_has_no_rows(empty):
    assert vertex_array(empty, "").shape == (0, 3)
    assert face_array(empty, 0, "").shape == (0, 3)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_cross_products_are_numpys_to_the_bit(count):
    numbers = np.random.default_rng(2)
    a, b = numbers.normal(size=(2, count, 3)) * 10.0 ** numbers.integers(-9, 9, (2, count, 3))
    assert cross_products(a, b).tobytes() == np.cross(a, b).tobytes()
