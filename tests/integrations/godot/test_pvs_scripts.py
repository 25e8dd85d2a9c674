"""The Godot scripts that hide by visible sets, without Godot: their grammar, and what they find in
a stand-in for the language (:mod:`tests.integrations.godot.stand_in`), held to the library."""

from __future__ import annotations

import re
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.scene import axis_order
from simplifier.io.pvs_file import encode_pvs
from tests.acceptance.command import ROOT
from tests.integrations.godot.stand_in import LOG, Node, Node3D, PackedByteArray, Vector3, script
from tests.io.damaged_pvs import DAMAGES, patched, town
from tests.strategies.visible_sets import points_around, visible_sets

FOLDER = ROOT / "integrations" / "godot"
PvsFile = script(FOLDER / "pvs_file.gd")
Culling = script(FOLDER / "pvs_culling.gd", preload=lambda name: script(FOLDER / name))

HARMLESS = (
    "all computed", "another box", "no slices", "many slices", "fewer slices", "slices that fall",
    "slices behind the end", "slices of another cell", "slices of a cell that is not computed",
    "nothing left of an object", "nothing left along y", "no such slice", "a height from above",
    "slices that are not there",
)  # fmt: skip
"""Damages to figures that the script makes no use of."""


@pytest.mark.parametrize("name", ["pvs_file.gd", "pvs_culling.gd"])
def test_it_is_gdscript_without_a_lint(name):
    pytest.importorskip("gdtoolkit", reason="GDScript's parser gdtoolkit is not installed")
    from gdtoolkit.linter import lint_code
    from gdtoolkit.parser import parser

    code = (FOLDER / name).read_text()
    parser.parse(code)
    assert lint_code(code) == []


def opened(data):
    """A reader, and what it says of the bytes."""
    reader = PvsFile.new()
    return reader, reader.parse(PackedByteArray(data))


@given(pvs=visible_sets(), seed=st.integers(0, 99))
def test_cells_and_sets_are_those_of_the_library(pvs, seed):
    pvs = replace(pvs, names=tuple(f"object {index}" for index in range(len(pvs.names))))
    reader, fault = opened(encode_pvs(pvs))
    assert fault == ""
    assert tuple(reader.names) == pvs.names
    for cell in range(len(pvs.cells)):
        assert list(reader.seen_from(cell)) == pvs.visible(cell).astype(int).tolist()
    assert list(reader.seen_from(reader.NO_CELL)) == [1] * len(pvs.names)
    around = points_around(pvs.cells, np.random.default_rng(seed)) + pvs.origin
    world = np.empty_like(around)
    world[:, axis_order(pvs.up)] = around
    for point, upright in zip(world.tolist(), pvs.to_cells(world), strict=True):
        x, y, z = point
        cells = pvs.cells.containing(upright).tolist()
        place = Vector3(x=x, y=y, z=z)
        assert reader.cell_at(place) == (cells[0] if cells else reader.NO_CELL)
        if len(cells) == 1:  # where there are more the library joins them
            seen = reader.seen_from_level(cells[0], reader.level_of(place))
            assert list(seen) == pvs.visible(point).astype(int).tolist()


@pytest.mark.parametrize("point", [(1e300, 0, 0), (np.inf, 0, 0), (0, np.nan, 0)])
def test_what_is_no_place_is_in_no_cell(point):
    reader, _ = opened(encode_pvs(town()))
    assert reader.cell_at(Vector3(**dict(zip("xyz", point, strict=True)))) == reader.NO_CELL


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_that_a_checksum_covers_is_refused(name):
    place, patch, _ = DAMAGES[name]
    data = encode_pvs(town())
    reader, fault = opened(patched(data, place(data), patch))
    if name in HARMLESS:
        assert fault == ""
        return
    assert re.match("it is |it names |this is no ", fault)
    assert (list(reader.names), list(reader.seen_from(0))) == ([], [])
    assert reader.cell_at(Vector3(x=5e6, y=2e6, z=100.0)) == reader.NO_CELL


def test_every_truncation_and_flipped_bit_is_refused():
    data = encode_pvs(town())
    files = [data[:length] for length in range(len(data))]
    for bit in range(8 * len(data)):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        files.append(bytes(flipped))
    for file in files:
        reader, fault = opened(file)
        assert fault != ""
        assert (len(reader.names), reader.cell_at(Vector3(x=0.0, y=0.0, z=0.0))) == (0, -1)


NAMES = ("a", "b", "c.d", "e")
CELL, OTHER, AWAY = (2e6 + 0.5, 100.5, 5e6 + 0.5), (2e6 + 0.5, 100.5, 5e6 + 2.5), (0.0, 0.0, 0.0)
"""Places in the first cell, which sees c.d and e; in the second, which sees b and c.d; in none.
The first two are just high enough for that."""


class Stage:
    """A scene, and the culling node on it; y is up, and the scene stands where it is ``at``."""

    def __init__(self, folder, *children, at=(0.0, 0.0, 0.0), data=None):
        LOG.clear()
        self.scene, self.at = Node3D("town", *children, at=at), at
        file = folder / "town.pvs"
        file.write_bytes(encode_pvs(town(names=NAMES)) if data is None else data)
        self.culling = Culling.new()
        self.culling.parent, self.culling.file = self.scene, str(file)
        self.culling._ready()

    def look_from(self, point):
        x, y, z = (one + by for one, by in zip(point, self.at, strict=True))
        self.culling.look_from(Vector3(x=x, y=y, z=z))


def flat():
    return [Node3D(name.replace(".", "_")) for name in NAMES]


def shown(nodes):
    return [node.visible for node in nodes]


def test_nodes_are_shown_and_hidden_when_the_cell_changes(tmp_path):
    nodes = flat()
    stage = Stage(tmp_path, *nodes, at=(10.0, 0.0, -3.0))
    for point, expected in (
        (AWAY, [1, 1, 1, 1]), (CELL, [0, 0, 1, 1]), (OTHER, [0, 1, 1, 0]), (AWAY, [1, 1, 1, 1]),
    ):  # fmt: skip
        stage.look_from(point)
        before = [node.changes for node in nodes]
        assert shown(nodes) == expected
        stage.look_from(point)
        assert [node.changes for node in nodes] == before
    assert LOG == []
    stage.look_from(CELL)
    stage.culling._exit_tree()
    assert shown(nodes) == [1, 1, 1, 1]
    stage.look_from(CELL)
    assert shown(nodes) == [0, 0, 1, 1]


def test_what_is_seen_from_higher_up_only_is_shown_there(tmp_path):
    """In the first cell e is seen from half up."""
    nodes = flat()
    stage = Stage(tmp_path, *nodes)
    x, _, z = CELL
    for height, expected in ((0.49, [0, 0, 1, 0]), (0.5, [0, 0, 1, 1]), (0.1, [0, 0, 1, 0])):
        stage.look_from((x, 100.0 + height, z))
        assert shown(nodes) == expected
    before = [node.changes for node in nodes]
    stage.look_from((x, 100.12, z))
    assert [node.changes for node in nodes] == before


def test_a_file_of_the_version_before_is_read(tmp_path):
    data = encode_pvs(town(names=NAMES, slices=None, altitudes=None))
    nodes = flat()
    stage = Stage(tmp_path, *nodes, data=patched(data, 8, struct.pack("<I", 2)))
    stage.look_from(CELL)
    assert (shown(nodes), LOG) == ([0, 0, 1, 1], [])


def test_a_node_stays_with_what_is_below_it(tmp_path):
    """Hiding a would take e along, which is seen; and between them is a node of another name."""
    below = Node3D("e")
    above = Node3D("a", Node3D("group", Node("none"), below))
    stage = Stage(tmp_path, above, Node3D("b"), Node3D("c_d"))
    stage.look_from(CELL)
    assert shown([above, below]) == [True, True]


def test_what_the_game_hides_stays_hidden_and_what_is_gone_is_let_be(tmp_path):
    nodes = flat()
    stage = Stage(tmp_path, *nodes)
    nodes[0].visible = False
    stage.look_from(CELL)
    nodes[1].valid = False
    stage.look_from(AWAY)
    assert shown(nodes) == [False, False, True, True]


def test_names_without_a_node_or_with_several_are_told_and_stay(tmp_path):
    twins = [Node3D("c_d"), Node3D("c_d")]
    stage = Stage(tmp_path, Node3D("a"), *twins)
    stage.look_from(CELL)
    assert shown(twins) == [True, True]
    (line,) = LOG
    assert line.startswith("WARNING: ")
    assert "3 of 4 objects have no node of their own name, and stay visible" in line


@pytest.mark.parametrize("data", [b"", b"no", encode_pvs(town(names=NAMES))[:-1]])
def test_a_broken_file_hides_nothing_and_is_an_error(tmp_path, data):
    nodes = flat()
    stage = Stage(tmp_path, *nodes, data=data)
    stage.look_from(CELL)
    assert shown(nodes) == [1, 1, 1, 1]
    assert stage.culling.processing is False
    (line,) = LOG
    assert line.startswith(f"ERROR: {tmp_path / 'town.pvs'}: ")
    assert line.endswith("; nothing is hidden")


def test_objects_of_one_node_are_all_of_it(tmp_path):
    """The importer writes both names alike: the node is seen where either object is."""
    nodes = [Node3D("a"), Node3D("e")]
    data = encode_pvs(town(names=("a", "b", "e", "e")))
    stage = Stage(tmp_path, *nodes, data=data)
    stage.look_from(OTHER)
    assert shown(nodes) == [False, True]
