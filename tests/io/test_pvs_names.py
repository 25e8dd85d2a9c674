"""Names of visible sets: what is coded comes back, and one group alone tells a name."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.io.pvs_names import GROUP, decode_names, encode_names

_NAMES = st.lists(st.text("abäåア\U0001f3f0\0", max_size=6), max_size=40)


@given(_NAMES)
def test_names_come_back(names):
    offsets, text = encode_names(names)
    assert len(offsets) == -(-len(names) // GROUP) + 1
    assert decode_names(offsets, text, len(names)) == tuple(names)


def test_what_a_name_shares_is_left_out():
    offsets, text = encode_names(["block 1 house 1", "block 1 house 2", "block 2"])
    assert text == b"\0\x0fblock 1 house 1" + b"\x0e\x012" + b"\6\0012"
    assert offsets.tolist() == [0, len(text)]


def test_letters_are_whole():
    _, text = encode_names(["ä", "å"])
    assert text == b"\0\2" + "ä".encode() + b"\0\2" + "å".encode()


def test_each_group_begins_with_a_whole_name():
    names = ["same"] * (GROUP + 1)
    offsets, text = encode_names(names)
    assert text[offsets[1] :] == b"\0\4same"
    assert decode_names(np.array([0, offsets[2] - offsets[1]]), text[offsets[1] :], 1) == ("same",)


def test_a_long_name_has_a_long_length():
    names = ["x" * 300, "x" * 300 + "y"]
    offsets, text = encode_names(names)
    assert text[:3] == b"\0\xac\2"
    assert text[-4:] == b"\xac\2\1y"
    assert decode_names(offsets, text, 2) == tuple(names)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "goes on"),
        (b"\0", "goes on"),
        (b"\0" + b"\x80" * 5 + b"\0", "goes on"),
        (b"\0\2a", "ends behind"),
        (b"\1\0", "begins with 1 bytes of one of 0"),
        (b"\0\1ab", "goes on behind"),
    ],
)
def test_what_is_no_name_is_refused(text, said):
    with pytest.raises(ValueError, match=said):
        decode_names(np.array([0, len(text)]), text, 1)
