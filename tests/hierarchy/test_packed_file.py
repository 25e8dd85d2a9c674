"""scene.occs beside scene.json: of that very scene, and not written again without need."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
import pytest

from simplifier.errors import OutputError
from simplifier.hierarchy.packed_file import (
    PACKED_FILE,
    read_packed,
    write_meshes,
    write_packed,
)
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.scene_file import load_occluder_tree, outline_of, read_earlier
from simplifier.io.occs_file import load_packed_tree
from tests.hierarchy.builds import built
from tests.hierarchy.scenes import QUICK, moved, street, with_object
from tests.io.test_occs_file import check_same


def current_packed(folder):
    packed = read_packed(folder)
    return packed.data if packed and packed.is_current() else None


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


def rewritten(scene, folder, known):
    """What the command writes of a build, beside what the folder as it is read gives."""
    build = built(scene, folder)
    outline, keys = outline_of(scene, QUICK, build)
    meshes = {**known, **build.meshes}
    return (
        write_meshes(folder, outline, [meshes[key] for key in keys]),
        write_packed(folder, load_occluder_tree(folder)),
        build,
    )


@pytest.mark.parametrize("options", [QUICK, replace(QUICK, conservative=True)])
def test_what_is_built_is_not_read_again(tmp_path, options):
    scene = street(4)
    build = built(scene, tmp_path, options)
    outline, keys = outline_of(scene, options, build)
    data = write_meshes(tmp_path, outline, [build.meshes[key] for key in keys])
    tree = load_occluder_tree(tmp_path)
    assert data == write_packed(tmp_path, tree)
    assert len(keys) == len(tree.occluders) > 0
    assert np.array_equal(outline.errors(), tree.errors())


def known_in(folder):
    packed = read_packed(folder)
    return packed.meshes(read_earlier(folder).keys) if packed else {}


def test_what_is_kept_is_taken_from_the_file_before(tmp_path):
    first, second, build = rewritten(street(4), tmp_path, {})
    assert first == second
    known = known_in(tmp_path)
    assert set(known) == {key for node in build.keys for key in (node.far, node.near) if key}
    first, second, build = rewritten(
        with_object(street(4), 1, transform=moved(40.0)), tmp_path, known
    )
    assert first == second
    assert build.kept > 0
    assert build.made > 0


def test_nothing_is_taken_from_a_file_that_is_not_of_the_manifest(tmp_path):
    assert known_in(tmp_path) == {}
    built(street(4), tmp_path)
    assert known_in(tmp_path) == {}
    data = write_packed(tmp_path, load_occluder_tree(tmp_path))
    (tmp_path / PACKED_FILE).write_bytes(data[:-1])
    assert known_in(tmp_path) == {}
    (tmp_path / PACKED_FILE).write_bytes(data)
    assert known_in(tmp_path)
    assert read_packed(tmp_path).meshes(["of", "other", "keys"]) == {}
    (tmp_path / "scene.json").write_bytes(b"{}")
    assert known_in(tmp_path) == {}
    (tmp_path / "scene.json").unlink()
    assert known_in(tmp_path) == {}
