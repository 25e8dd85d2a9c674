"""Packed scenes as files: what is written comes back, and no damage is taken for a tree."""

from __future__ import annotations

import struct
from dataclasses import fields

import numpy as np
import pytest

import simplifier
from simplifier.errors import OutputError, SceneError
from simplifier.io.occs_file import decode_occs, encode_occs, load_packed_tree, save_packed_tree
from tests.allocating import most_allocated
from tests.io.damaged_occs import (
    BLOCKS,
    DAMAGES,
    FOR_PYTHON,
    HEADER,
    block,
    patched,
    signed,
    town,
)


def check_same(one, other):
    for field in fields(one):
        first, second = getattr(one, field.name), getattr(other, field.name)
        if isinstance(first, np.ndarray):
            assert first.dtype == second.dtype, field.name
            np.testing.assert_array_equal(first, second)
        else:
            assert first == second, field.name


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"worth": None},
        {"up": "x", "conservative": False, "pairs": np.empty((0, 2), np.uint32)},
        {"about": {}, "rows": 1, "fov": 1e-6, "pixel_error": 1e-300},
    ],
)
def test_what_is_written_comes_back_and_is_written_alike(changes):
    tree = town(**changes)
    if not tree.conservative:
        tree.meshes["first_pair"], tree.meshes["pair_count"] = 0, 0
    data = encode_occs(tree)
    back = decode_occs(data, "town.occs")
    check_same(back, tree)
    assert encode_occs(back) == data


def test_a_file_as_a_script_uses_it(tmp_path):
    save_packed_tree(town(), str(tmp_path / "town.occs"))
    tree = simplifier.load_packed_tree(str(tmp_path / "town.occs"))
    assert isinstance(tree, simplifier.PackedTree)
    assert tree.objects == ("Häuser", "b")
    vertices, faces = tree.mesh(0)
    assert vertices[faces].shape == (4, 3, 3)


def test_the_layout_is_as_the_docs_say():
    data = encode_occs(town())
    assert data[:8] == b"\x89OCS\r\n\x1a\n"
    assert struct.unpack_from("<IIQ", data, 8) == (1, 1 | 2 << 8, len(data))
    assert struct.unpack_from("<8I", data, 24) == (5, 3, 2, 3, 3, 10, 10, 6)
    assert struct.unpack_from("<5d2I", data, 56) == (5e6, 0.0, 0.0, 0.5, 60.0, 180, 18)
    starts = struct.unpack_from("<11I", data, BLOCKS["nodes"])
    assert starts[0] == HEADER // 16
    assert list(starts) == sorted(starts)
    assert len(data) % 16 == 0
    assert data[148:156] == bytes(8)
    root = struct.unpack_from("<6f2I4f4I", data, block(data, "nodes"))
    none = 2**32 - 1
    assert root == (0, 0, 0, 9, 2, 2, 2, none, 0.5, 0.75, 3.0, 0.0, 1, 2, 0, 3)
    leaf = struct.unpack_from("<2I4f4I", data, block(data, "nodes") + 2 * 64 + 24)
    assert leaf == (1, 0, 0.125, 0.25, 1.0, 1.5, 0, 0, 2, 1)
    assert struct.unpack_from("<9I", data, block(data, "parts")) == (0, 0, 4, 1, 1, 3, 1, 2, 2)
    assert struct.unpack_from("<3I", data, block(data, "order")) == (1, 0, 2)
    first = struct.unpack_from("<12d", data, block(data, "transforms"))
    assert first == (1, 0, 0, 5e6 + 3.0, 0, 1, 0, 0, 0, 0, 1, 0)
    second = struct.unpack_from("<3d6I", data, block(data, "meshes") + 48)
    assert second == (1, 1, 1, 4, 3, 6, 1, 6, 0)
    assert struct.unpack_from("<3f", data, block(data, "positions") + 12) == (1, -1, -1)
    assert struct.unpack_from("<3H", data, block(data, "indices") + 24) == (0, 1, 2)
    assert struct.unpack_from("<4I", data, block(data, "pairs")) == (0, 5, 1, 11)
    assert struct.unpack_from("<5f", data, block(data, "worth")) == (1.0, 0.0, 2.0, 0.5, 1.0)
    names = block(data, "names")
    assert struct.unpack_from("<3I", data, names) == (0, 8, 10)
    assert data[names + 12 : names + 22] == "Häuser\0b\0".encode()
    assert data[block(data, "about") :][:18] == b'{"made by":"hand"}'


def test_what_there_is_none_of_has_no_block():
    tree = town(worth=None, conservative=False, pairs=np.empty((0, 2), np.uint32))
    tree.meshes["first_pair"], tree.meshes["pair_count"] = 0, 0
    data = encode_occs(tree)
    assert struct.unpack_from("<2I", data, BLOCKS["pairs"]) == (0, 0)


def test_wide_indices_come_back():
    count = 65_536
    tree = town()
    tree.meshes[2] = ((0, 0, 0), 7, count, 8, 1, 6, 0)
    positions = np.zeros((7 + count, 3), np.float32)
    indices = np.append(tree.indices[:8], np.array([0, count - 1, 5], np.uint32))
    wide = town(meshes=tree.meshes, positions=positions, indices=indices)
    back = decode_occs(encode_occs(wide), "wide.occs")
    assert back.mesh(2)[1].tolist() == [[0, count - 1, 5]]
    assert back.mesh(1)[1].tolist() == [[0, 1, 2]]
    data = encode_occs(wide)
    with pytest.raises(SceneError, match="vertex that it does not have"):
        decode_occs(patched(data, block(data, "indices") + 36, struct.pack("<I", count)), "x")


@pytest.mark.parametrize("name", [*DAMAGES, *FOR_PYTHON])
def test_damage_is_refused(name):
    place, patch, said = {**DAMAGES, **FOR_PYTHON}[name]
    data = encode_occs(town())
    with pytest.raises(SceneError, match=said) as caught:
        decode_occs(patched(data, place(data), patch), "town.occs")
    assert caught.value.where == "town.occs"
    assert caught.value.remedy


def test_every_truncation_and_flipped_bit_is_refused():
    data = encode_occs(town())
    for length in range(0, len(data), 5):
        with pytest.raises(SceneError):
            decode_occs(data[:length], "cut.occs")
    for place in range(len(data)):
        flipped = bytearray(data)
        flipped[place] ^= 1 << place % 8
        with pytest.raises(SceneError):
            decode_occs(bytes(flipped), "flipped.occs")


def test_no_room_is_made_for_what_is_not_there():
    data = encode_occs(town())
    for offset in range(24, 56, 4):
        lying = patched(data, offset, struct.pack("<I", 2**32 - 1))

        def refuse(lying=lying):
            with pytest.raises(SceneError):
                decode_occs(lying, "lying.occs")

        assert most_allocated(refuse) < 1 << 20


def test_names_that_no_file_can_hold_become_others():
    tree = town(objects=("half \ud800", "cut\0off"))
    assert decode_occs(encode_occs(tree), "x").objects == ("half ?", "cut?off")


@pytest.mark.parametrize(
    "content", [b"", b"PK\3\4" + bytes(500), b"\x89OCC\r\n\x1a\n" + bytes(500)]
)
def test_other_files_are_refused(tmp_path, content):
    (tmp_path / "other.occs").write_bytes(content)
    with pytest.raises(SceneError):
        load_packed_tree(tmp_path / "other.occs")
    with pytest.raises(SceneError, match="no such file"):
        load_packed_tree(tmp_path / "missing.occs")
    with pytest.raises(SceneError, match="folder"):
        load_packed_tree(tmp_path)


def test_what_the_format_has_no_room_for_is_refused(monkeypatch):
    monkeypatch.setattr("simplifier.io.blocks.MOST", 9)
    with pytest.raises(OutputError, match="10 vertices are more"):
        encode_occs(town())


def test_the_checksum_is_of_the_whole_file():
    data = encode_occs(town())
    assert signed(data) == data
