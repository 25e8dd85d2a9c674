"""Files of visible sets: what is written comes back, and no damage is taken for sets."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplifier
from simplifier.errors import OutputError, UnreadablePvsError
from simplifier.geometry.pvs import Altitudes, Rows, Slices, pack_rows
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_file import decode_pvs, encode_pvs, load_pvs, save_pvs
from tests.allocating import most_allocated
from tests.io.damaged_pvs import (
    ALTITUDES,
    BLOCKS,
    DAMAGES,
    HEADER,
    SLICES,
    block,
    patched,
    signed,
    town,
)
from tests.strategies.visible_sets import visible_sets


def check_same(one, other):
    for name in ("up", "names", "method", "conservative", "scene", "settings"):
        assert getattr(one, name) == getattr(other, name), name
    assert one.rows.data == other.rows.data
    for name in ("origin", "order", "row_of"):
        first, second = getattr(one, name), getattr(other, name)
        assert first.dtype == second.dtype
        assert np.array_equal(first, second), name
    assert np.array_equal(one.rows.offsets, other.rows.offsets)
    for part, names in (("slices", "starts values"), ("altitudes", "values")):
        first, second = getattr(one, part), getattr(other, part)
        assert (first is None) == (second is None)
        if first is not None:
            for name in names.split():
                assert np.array_equal(getattr(first, name), getattr(second, name)), name
                assert getattr(first, name).dtype == getattr(second, name).dtype
            for name in ("low", "step", "count"):
                assert getattr(first, name, None) == getattr(second, name, None)
    for name in ("kinds", "low", "high", "corners"):
        first, second = getattr(one.cells, name), getattr(other.cells, name)
        assert first.dtype == second.dtype
        assert np.array_equal(first, second), name


@given(visible_sets())
def test_what_is_written_comes_back_and_is_written_alike(pvs):
    data = encode_pvs(pvs)
    back = decode_pvs(data, "some.pvs")
    check_same(back, pvs)
    assert encode_pvs(back) == data


def test_a_file_as_a_script_uses_it(tmp_path):
    save_pvs(town(), tmp_path / "town.pvs")
    pvs = simplifier.load_pvs(str(tmp_path / "town.pvs"))
    assert isinstance(pvs, simplifier.Pvs)
    assert pvs.visible(0).tolist() == [False, False, True, True]
    assert pvs.visible((2e6 + 1.0, 101.0, 5e6 + 0.5)).tolist() == [False, False, True, True]
    assert pvs.visible((0.0, 0.0, 0.0)).all()


def test_the_layout_is_as_the_docs_say():
    data = encode_pvs(town())
    assert data[:8] == b"\x89PVS\r\n\x1a\n"
    assert struct.unpack_from("<IIQIIII", data, 8) == (3, 15 | 1 << 8, len(data), 4, 4, 3, 1)
    assert struct.unpack_from("<3d", data, 40) == (5e6, 2e6, 100.0)
    assert struct.unpack_from("<6f", data, 64) == (0.0, 0.0, 0.0, 9.0, 9.0, 3.0)
    assert data[124:140] == b"town\0\0\0\0" + bytes(range(8))
    starts = struct.unpack_from("<9I", data, 88)
    assert all(starts)
    assert starts[0] == HEADER // 16
    assert len(data) % 16 == 0
    assert struct.unpack_from("<4I", data, block(data, "order")) == (3, 2, 1, 0)
    box = struct.unpack_from("<8f", data, block(data, "cells"))
    assert (*box[:4], *box[6:]) == (0.0, 0.0, 2.0, 2.0, 0.0, 2.0)
    assert np.isnan(box[4:6]).all()
    assert struct.unpack_from("<8f", data, block(data, "cells") + 96) == (6, 0, 4, 4, 4, 0, 0, 3)
    assert struct.unpack_from("<4I", data, block(data, "row_of")) == (0, 1, 0xFFFFFFFF, 2)
    assert struct.unpack_from("<4I", data, block(data, "row_offsets")) == (0, 2, 4, 6)
    assert data[block(data, "rows") :][:6] == bytes([0, 2, 1, 2, 3, 1])
    slices = block(data, "slices")
    assert struct.unpack_from("<9I", data, slices) == (8, 0, 0, 0, 0, 2, 4, 4, 5)
    assert struct.unpack_from("<15b", data, slices + 36) == (
        0, -2, 5, 3, 0, 0,  # d before c, as the row names them
        0, 0, 0, -1, 0, 3,
        8, -7, 8,
    )  # fmt: skip
    altitudes = block(data, "altitudes")
    assert struct.unpack_from("<2f2I", data, altitudes) == (0.0, 0.25, 0, 0)
    assert struct.unpack_from("<4H", data, altitudes + 16) == (65535, 65535, 0, 2)
    names = block(data, "names")
    assert struct.unpack_from("<2I", data, names) == (0, 20)
    assert data[names + 8 : names + 28] == b"\0\1a\0\1b\0\7" + "Häuser".encode() + b"\3\3fen"


def test_parts_are_left_out_where_there_are_none_and_an_older_version_is_read():
    plain = town(slices=None, altitudes=None)
    data = encode_pvs(plain)
    assert struct.unpack_from("<II", data, BLOCKS["slices"]) == (0, 0)
    assert struct.unpack_from("<I", data, 12) == (1 | 8 | 1 << 8,)
    check_same(decode_pvs(patched(data, 8, struct.pack("<I", 2)), "old.pvs"), plain)


def test_names_are_left_out_where_there_are_none():
    data = encode_pvs(town(names=("",) * 4))
    assert struct.unpack_from("<I", data, BLOCKS["names"]) == (0,)
    assert decode_pvs(data, "town.pvs").names == ("",) * 4


def test_what_utf_8_cannot_write_of_a_name_is_marked():
    assert decode_pvs(encode_pvs(town(names=("a\ud800", "b", "c", "d"))), "").names[0] == "a?"


def test_every_truncation_and_every_flipped_bit_is_refused():
    data = encode_pvs(town())
    for length in range(len(data)):
        with pytest.raises(UnreadablePvsError):
            decode_pvs(data[:length], "town.pvs")
    with pytest.raises(UnreadablePvsError):
        decode_pvs(data + bytes(16), "town.pvs")
    for bit in range(8 * len(data)):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        with pytest.raises(UnreadablePvsError):
            decode_pvs(bytes(flipped), "town.pvs")


@given(visible_sets(), st.data())
def test_damage_under_a_right_checksum_is_refused_or_harmless(pvs, given_data):
    """What passes has sets that can be looked at."""
    data = bytearray(encode_pvs(pvs))
    for _ in range(given_data.draw(st.integers(1, 3))):
        place = given_data.draw(st.integers(8, len(data) - 1))
        data[place] = given_data.draw(st.integers(0, 255))
    try:
        found = decode_pvs(signed(data), "town.pvs")
    except UnreadablePvsError as error:
        assert error.remedy  # noqa: PT017
        return
    for cell in range(len(found.cells)):
        assert found.visible(cell).shape == (len(found.names),)
        assert found.drawn(cell).shape == (len(found.names), 3, 2)
    found.visible((0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", DAMAGES)
def test_each_damage_is_named(name):
    place, patch, said = DAMAGES[name]
    data = encode_pvs(town())
    with pytest.raises(UnreadablePvsError, match=f"^town.pvs: .*{said}"):
        decode_pvs(patched(data, place(data), patch), "town.pvs")


@pytest.mark.parametrize("place", [*range(24, 40, 4), *range(88, 124, 4)])
@pytest.mark.parametrize("value", [2**32 - 1, 2**31 - 1, 9])
def test_a_header_alone_makes_no_room(place, value):
    data = bytearray(encode_pvs(town())[:HEADER])
    data[12:16], data[16:24] = struct.pack("<I", 6), struct.pack("<Q", HEADER)
    for offset in BLOCKS.values():
        data[offset : offset + 4] = struct.pack("<I", 9)
    data[24:40] = bytes(16)
    data[place : place + 4] = struct.pack("<I", value)
    data = signed(data)

    def refuse():
        with pytest.raises(UnreadablePvsError):
            decode_pvs(data, "header.pvs")

    assert most_allocated(refuse) < 1 << 20


def test_runs_are_checked_in_parts():
    """More bytes than are looked at together, with the fault in the last row."""
    long = np.zeros(600_000, bool)
    long[::2] = True
    short = np.ones(1, bool)
    rows, _ = pack_rows([long, short, np.roll(long, 1)])
    rows.check(600_000)
    data = bytearray(rows.data)
    data[-1] = 9
    with pytest.raises(ValueError, match="longer than the 600000 objects"):
        Rows(bytes(data), rows.offsets).check(600_000)


@pytest.mark.parametrize(
    "changes",
    [
        {"origin": np.array([np.inf, 0.0, 0.0])},
        {
            "cells": ViewCells.boxes(np.zeros((1, 3)), np.array([[2e36, 1.0, 1.0]])),
            "row_of": np.zeros(1, np.int64),
        },
    ],
)
def test_what_the_format_has_no_room_for_is_refused(changes, tmp_path):
    with pytest.raises(OutputError, match="visible sets: the view cells reach"):
        save_pvs(town(**changes), tmp_path / "town.pvs")
    assert list(tmp_path.iterdir()) == []


STARTS = np.array([0, 2, 4, 4, 5])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"slices": Slices(STARTS, np.full((5, 3), -1, np.int8))}, "none of 8"),
        ({"slices": Slices(STARTS, SLICES, 128)}, "none of 128"),
        ({"slices": Slices(STARTS[:-1], SLICES)}, "slices of 3 cells and 5 objects"),
        ({"slices": Slices(STARTS, SLICES[:4])}, "slices of 4 cells and 4 objects"),
        ({"slices": Slices(np.array([0, 1, 4, 4, 5]), SLICES)}, "in cell 0, which sees 2"),
        ({"altitudes": Altitudes(0.0, 0.0, ALTITUDES)}, "altitudes of 0.0 by 0.0"),
        ({"altitudes": Altitudes(0.1, 1.0, ALTITUDES)}, "not float32"),
        ({"altitudes": Altitudes(0.0, 1.0, ALTITUDES[:3])}, r"of shape \(3, 4\)"),
    ],
)
def test_parts_that_do_not_fit_the_sets_are_refused(changes, said):
    with pytest.raises(OutputError, match=said):
        encode_pvs(town(**changes))


def test_what_is_no_such_file_is_refused(tmp_path):
    (tmp_path / "town.glb").write_bytes(b"glTF" + bytes(200))
    with pytest.raises(UnreadablePvsError, match="does not begin as one"):
        load_pvs(tmp_path / "town.glb")
    with pytest.raises(UnreadablePvsError, match="no such file"):
        load_pvs(tmp_path / "lost.pvs")
    with pytest.raises(UnreadablePvsError, match="name a file of visible sets"):
        load_pvs(tmp_path)
    with pytest.raises(OutputError, match="no folder"):
        save_pvs(town(), tmp_path / "lost" / "town.pvs")
