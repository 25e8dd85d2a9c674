"""Occluders in files: whole or not at all, and known to be as they were written."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.errors import MeshError, OutputError
from simplifier.geometry.occluder import Occluder
from simplifier.hierarchy.node_plan import is_key
from simplifier.hierarchy.store import OccluderFile, OccluderStore
from simplifier.io.save import save_occluder
from tests.solids import blob

KEY, OTHER = "0123456789abcdef" * 2, "f" * 32
MESH = blob(rings=4)
OCCLUDER = Occluder(MESH.vertices, MESH.faces, 0.25)
NOTHING = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), 0.0)


@pytest.fixture
def store(tmp_path):
    return OccluderStore(tmp_path)


def test_what_is_written_is_read(store):
    summary = store.write(KEY, OccluderFile.of(OCCLUDER))
    assert store.keys() == {KEY}
    occluder = store.read(KEY)
    np.testing.assert_allclose(
        occluder.vertices[occluder.faces], MESH.vertices[MESH.faces], atol=1e-6
    )
    assert (summary.triangles, summary.error_bound) == (len(MESH.faces), 0.25)
    assert 0.5 < summary.radius < 2.0


def test_the_summary_does_not_depend_on_who_asks(store):
    """It was of unrounded vertices for who wrote them: a resumed build gave other bytes."""
    summary = store.write(KEY, OccluderFile.of(OCCLUDER))
    assert OccluderStore(store.folder).summary(KEY) == summary
    assert store.kept(KEY) == store.kept(KEY, summary) == summary


def test_nothing_is_kept_too(store):
    summary = store.write(KEY, OccluderFile.of(NOTHING))
    assert (summary.triangles, summary.error_bound, summary.radius) == (0, 0.0, 0.0)
    assert len(store.read(KEY).faces) == 0


@pytest.mark.parametrize(
    "damage", [lambda data: data[:100], lambda data: b"", lambda data: b"x" * 99]
)
def test_a_damaged_file_says_so_and_is_made_again(store, damage):
    summary = store.write(KEY, OccluderFile.of(OCCLUDER))
    path = store.path(KEY)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(MeshError, match=KEY):
        store.read(KEY)
    assert store.kept(KEY) is None
    assert store.kept(KEY, summary) is None


def test_a_changed_file_is_made_again(store):
    summary = store.write(KEY, OccluderFile.of(OCCLUDER))
    store.write(KEY, OccluderFile.of(Occluder(MESH.vertices * 2.0, MESH.faces, 0.25)))
    assert store.kept(KEY, summary) is None


def test_a_missing_file_is_made_again(store):
    summary = store.write(KEY, OccluderFile.of(OCCLUDER))
    assert store.kept(OTHER) is None
    assert store.kept(OTHER, summary) is None


def test_an_occluder_that_promises_nothing_is_refused(store):
    save_occluder(Occluder(MESH.vertices, MESH.faces), store.path(KEY))
    with pytest.raises(MeshError, match="stray"):
        store.read(KEY)
    assert store.kept(KEY) is None


def test_only_stale_occluders_and_drafts_go(store):
    for key in (KEY, OTHER):
        store.write(key, OccluderFile.of(NOTHING))
    ours = [store.folder / ".occluder-0123456789abcdef.tmp"]
    theirs = [
        store.folder / name for name in ("castle.glb", "notes.txt", f"{OTHER}.obj", ".hidden")
    ]
    for path in ours + theirs:
        path.write_bytes(b"")
    store.keep_only({KEY})
    assert store.keys() == {KEY}
    assert set(store.folder.iterdir()) == {store.path(KEY), *theirs}


@pytest.mark.parametrize(
    "key", ["", "../" + KEY, KEY[:31], KEY + "0", KEY.upper(), "../../etc/passwd"]
)
def test_no_key_leads_out_of_the_folder(store, key):
    assert not is_key(key)
    with pytest.raises(ValueError, match="not a key"):
        store.path(key)


def test_without_a_folder_nothing_is_there_and_nothing_is_made(tmp_path):
    store = OccluderStore(tmp_path / "absent")
    assert store.keys() == set()
    store.keep_only(())
    with pytest.raises(OutputError):
        store.write(KEY, OccluderFile.of(NOTHING))
    assert not store.folder.exists()
