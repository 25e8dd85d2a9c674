"""Rows of lists, followed by the kernel and by struct."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.ply import NEGATIVE, TRUNCATED, walk_rows

CODES = {"b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4, "q": 8, "Q": 8}


def walk(data: bytes, rows: int, columns: list[tuple[str, int]], order: str):
    """``columns``: the code of the value or list length, and the bytes of an item (0: no list)."""
    places = np.full((rows, len(columns)), -9, dtype=np.int64)
    result = walk_rows(
        np.frombuffer(data, dtype=np.uint8),
        0,
        np.array([item > 0 for _, item in columns]),
        np.array([CODES[code] for code, _ in columns], dtype=np.int64),
        np.array([max(item, 1) for _, item in columns], dtype=np.int64),
        np.array([code.islower() for code, _ in columns]),
        order == ">",
        places,
    )
    return result, places


columns = st.lists(
    st.tuples(st.sampled_from(sorted(CODES)), st.integers(0, 8)), min_size=1, max_size=4
)


@settings(max_examples=150, deadline=None)
@given(columns, st.integers(0, 6), st.sampled_from("<>"), st.randoms(use_true_random=False))
def test_places_match_struct(columns, rows: int, order: str, random) -> None:
    data, expected = b"", []
    for _ in range(rows):
        starts = []
        for code, item in columns:
            starts.append(len(data))
            length = random.randrange(0, 100)
            data += struct.pack(order + code, length) + b"\7" * (item * length)
        expected.append(starts)
    (end, row), places = walk(data + b"behind", rows, columns, order)
    assert (end, row) == (len(data), 0)
    assert places.tolist() == expected
    if data:
        (end, _), _ = walk(data[:-1], rows, columns, order)
        assert end == TRUNCATED


@pytest.mark.parametrize("code", ["b", "h", "i", "q"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_a_negative_length_is_found(code: str, order: str) -> None:
    data = struct.pack(order + code, 0) + struct.pack(order + code, -1) + b"\0" * 9
    assert walk(data, 2, [(code, 4)], order)[0] == (NEGATIVE, 1)


@pytest.mark.parametrize("length", [2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1])
def test_lengths_that_would_overflow_are_found(length: int) -> None:
    data = struct.pack("<Q", length) + b"\0" * 64
    (end, row), _ = walk(data, 1, [("Q", 8)], "<")
    assert end in (TRUNCATED, NEGATIVE)
    assert row == 0
