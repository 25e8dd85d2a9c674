"""scene.occs beside scene.json: of that very scene, and not written again without need."""

from __future__ import annotations

import zlib
from dataclasses import replace

import pytest

from simplifier.errors import OutputError
from simplifier.hierarchy.packed_file import PACKED_FILE, current_packed, write_packed
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.scene_file import load_occluder_tree
from simplifier.io.occs_file import load_packed_tree
from tests.hierarchy.builds import built
from tests.hierarchy.scenes import moved, street, with_object
from tests.io.test_occs_file import check_same


def test_it_holds_the_tree_of_the_manifest(tmp_path):
    built(street(4), tmp_path)
    assert current_packed(tmp_path) is None
    tree = load_occluder_tree(tmp_path)
    data = write_packed(tmp_path, tree)
    assert current_packed(tmp_path) == data == (tmp_path / PACKED_FILE).read_bytes()
    packed = load_packed_tree(tmp_path / PACKED_FILE)
    assert packed.about["manifest"] == zlib.crc32((tmp_path / "scene.json").read_bytes())
    check_same(packed, replace(pack_tree(tree), about=packed.about))


def test_of_another_state_of_the_scene_or_damaged_it_is_not_current(tmp_path):
    built(street(4), tmp_path)
    data = write_packed(tmp_path, load_occluder_tree(tmp_path))
    (tmp_path / PACKED_FILE).write_bytes(data[:-1])
    assert current_packed(tmp_path) is None
    (tmp_path / PACKED_FILE).write_bytes(data)
    assert current_packed(tmp_path) == data
    built(with_object(street(4), 1, transform=moved(40.0)), tmp_path)
    assert current_packed(tmp_path) is None


def test_where_it_cannot_be_written_none_is_left(tmp_path):
    built(street(4), tmp_path)
    tree = load_occluder_tree(tmp_path)
    write_packed(tmp_path, tree)
    far = replace(tree, tree=replace(tree.tree, bounds=tree.tree.bounds * 1e40))
    with pytest.raises(OutputError):
        write_packed(tmp_path, far)
    assert not (tmp_path / PACKED_FILE).exists()
