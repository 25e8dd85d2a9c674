"""The Godot script that gives each part of a scene its occluder, in a stand-in for the language."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.packed_tree import NONE
from simplifier.hierarchy.packing import pack_tree
from simplifier.io.occs_file import encode_occs
from tests.acceptance.command import ROOT
from tests.culling.test_culler import random_tree
from tests.integrations.godot.stand_in import LOG, Packed, PackedByteArray, script
from tests.io.damaged_occs import DAMAGES, patched, town

SCRIPT = ROOT / "integrations" / "godot" / "occs_occluders.gd"

USED = (
    "another version", "a flag of later", "a longer file", "many nodes", "many parts",
    "many transforms", "fewer transforms", "many occluders", "many vertices", "many indices",
    "a block behind the end", "no such near occluder", "no such transform", "no such leaf",
    "a transform of NaN", "an occluder's origin of NaN", "many vertices of one",
    "many triangles", "a position of NaN", "no such vertex",
)  # fmt: skip
"""Damages to what the script makes use of."""


class ArrayOccluder3D:
    @classmethod
    def new(cls):
        return cls()

    def set_arrays(self, vertices, indices):
        self.vertices, self.indices = vertices, indices


class OccluderInstance3D(ArrayOccluder3D):
    pass


CHILDREN: list[OccluderInstance3D] = []
Occluders = script(
    SCRIPT, add_child=CHILDREN.append, ArrayOccluder3D=ArrayOccluder3D,
    OccluderInstance3D=OccluderInstance3D, PackedVector3Array=Packed, Vector3=lambda *xyz: xyz,
    Transform3D=lambda *columns: np.array(columns).T,
    range=lambda *ends: range(*map(int, ends)),
)  # fmt: skip


def test_it_is_gdscript_without_a_lint():
    pytest.importorskip("gdtoolkit", reason="GDScript's parser gdtoolkit is not installed")
    from gdtoolkit.linter import lint_code
    from gdtoolkit.parser import parser

    parser.parse(SCRIPT.read_text())
    assert lint_code(SCRIPT.read_text()) == []


@pytest.mark.parametrize("packed", [town(), pack_tree(random_tree(np.random.default_rng(3)))])
def test_each_part_gets_its_occluder_where_it_is(packed, tmp_path):
    (tmp_path / "scene.occs").write_bytes(encode_occs(packed))
    node = Occluders.new()
    node.file = str(tmp_path / "scene.occs")
    CHILDREN.clear()
    node._ready()
    found = {int(child.name.removeprefix("Occluder")): child for child in CHILDREN}
    expected = 0
    for index, part in enumerate(packed.parts):
        leaf = packed.nodes[part["node"]]
        mesh = leaf["near"] if leaf["near"] != NONE else leaf["far"]
        if mesh == NONE:
            continue
        expected += 1
        vertices, faces = packed.mesh(int(mesh))
        child = found[index]
        np.testing.assert_allclose(np.array(child.occluder.vertices), vertices)
        assert np.reshape(child.occluder.indices, (-1, 3)).tolist() == faces.tolist()
        np.testing.assert_array_equal(child.transform, packed.transforms[part["transform"]])
    assert len(found) == expected > 0


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_to_what_is_used_makes_none_and_is_told(name, tmp_path):
    place, patch, _ = DAMAGES[name]
    data = encode_occs(town())
    (tmp_path / "bad.occs").write_bytes(patched(data, place(data), patch))
    node = Occluders.new()
    node.file = str(tmp_path / "bad.occs")
    CHILDREN.clear()
    LOG.clear()
    node._ready()  # whatever it holds, nothing is read past its end
    if name in USED:
        assert [line.startswith("ERROR: ") for line in LOG] == [True]
    assert not (LOG and CHILDREN)


def test_a_byte_that_is_another_and_a_file_that_is_missing_make_none():
    data = bytearray(encode_occs(town()))
    data[-1] ^= 1
    node = Occluders.new()
    assert "not those that were written" in node.parse(PackedByteArray(data))
    assert "no packed scene" in node.parse(PackedByteArray(b""))
    assert node.part_count() == 0
