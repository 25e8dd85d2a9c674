"""What a kernel says that it takes, and whether arguments are that."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.kernels.compiled.signature import Group, Number, Table, misfit, parse_signature

ALL = "float64[:, :], (uint8[:, :, :], int64), bool, int64[:]"
FITTING = (np.zeros((2, 3)), (np.zeros((1, 2, 3), np.uint8), 3), True, np.arange(4))


def test_a_text_names_arrays_tuples_and_numbers():
    found = parse_signature(ALL)
    assert found.parts == (
        Table("float64", 2), Group((Table("uint8", 3), Number("int64"))), Number("bool"),
        Table("int64", 1),
    )  # fmt: skip
    assert str(found) == f"({ALL})"
    assert found.fits(FITTING)


@pytest.mark.parametrize(
    "text", ["", "float64[:,", "float64[3]", "text", "int32", "nothing[:]", "float64[:].T", "1"]
)
def test_what_is_no_such_text_is_refused(text):
    with pytest.raises(ValueError, match="names no arguments"):
        parse_signature(text)


@pytest.mark.parametrize(
    ("place", "given", "words"),
    [
        (0, np.zeros((2, 3), np.float32), r"argument 0 is float32\[:, :\], where it takes"),
        (0, np.zeros((2, 3))[:, ::2], "not C-contiguous"),
        (0, np.zeros((3, 2)).T, "not C-contiguous"),
        (0, np.zeros(6), r"float64\[:\]"),
        (0, [[1.0]], "list"),
        (0, np.zeros((2, 3), ">f8"), ">f8|float64"),
        (0, np.frombuffer(bytes(17), np.float64, 2, 1).reshape(1, 2), "not C-contiguous"),
        (1, (np.zeros((1, 2, 3), np.uint8), 3.0), "float"),
        (1, (np.zeros((1, 2, 3), np.uint8),), "argument 1"),
        (1, [np.zeros((1, 2, 3), np.uint8), 3], "list"),
        (2, 1, "int"),
        (3, np.arange(4, dtype=np.uint64), "uint64"),
    ],
)
def test_what_does_not_fit_is_told(place, given, words):
    signature = parse_signature(ALL)
    arguments = (*FITTING[:place], given, *FITTING[place + 1 :])
    assert not signature.fits(arguments)
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(misfit(signature, arguments))


def test_a_wrong_number_of_arguments_does_not_fit():
    signature = parse_signature("int64, int64")
    assert not signature.fits((1,))
    assert misfit(signature, (1,)) == "1 arguments, where it takes 2"


def test_read_only_arrays_and_numbers_of_numpy_fit():
    held = np.zeros((2, 3))
    held.setflags(write=False)
    assert parse_signature("float64[:, :], float64, int64, uint64, bool").fits(
        (held, np.float32(1.0), np.int32(1), np.uint64(2**64 - 1), np.True_)
    )
    assert parse_signature("float64").fits((1,))
