"""What is built again when files change, by a maker that takes no time."""

from __future__ import annotations

import threading
import time

import pytest

from simplifier.builds.watch import watch_assets
from simplifier.cli.findings import line_of
from simplifier.errors import ManifestError
from tests.builds.quick import (
    BUILT,
    CURRENT,
    FAILED,
    GONE,
    SETTINGS,
    TRIANGLE,
    QuickMaker,
    write,
)


class Watch:
    """Watches until it is ended; ``heard`` are findings and refusals, in order."""

    def __init__(self, manifest, maker=None):
        self.heard, self.maker = [], maker or QuickMaker()
        self._cancel = threading.Event()
        self._thread = threading.Thread(
            target=watch_assets,
            args=(manifest, self._cancel),
            kwargs={"found": self.heard.append, "refused": self.heard.append, "maker": self.maker},
        )
        self._thread.start()

    def until(self, condition, seconds=20.0):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, self.heard
            time.sleep(0.02)

    def hears(self, asset, state):
        """Wait for the next finding of an asset; what it says."""
        said = []

        def come():
            said[:] = [one for one in self.heard
                       if getattr(one, "asset", None) == asset and one.state is state]  # fmt: skip
            return said

        self.until(come)
        self.heard.clear()
        return said[-1]

    def end(self):
        self._cancel.set()
        self._thread.join(10.0)
        assert not self._thread.is_alive()


@pytest.fixture
def watch(tmp_path):
    """Of a manifest with one mesh, built by now."""
    watch = Watch(write(tmp_path, a=TRIANGLE))
    watch.hears("a.obj", BUILT)
    yield watch
    watch.end()


def test_a_changed_mesh_and_a_new_one_are_built(watch, tmp_path):
    (tmp_path / "a.obj").write_bytes(TRIANGLE + b"# 0.8\n")
    assert watch.hears("a.obj", BUILT).why == "the mesh has changed"
    (tmp_path / "props").mkdir()
    (tmp_path / "props" / "b.obj").write_bytes(TRIANGLE)
    watch.hears("props/b.obj", BUILT)
    assert (tmp_path / "props" / "b_occluder.glb").read_bytes() == TRIANGLE


def test_overrides_that_come_and_go_are_followed(watch, tmp_path):
    decided = tmp_path / "a.overrides.toml"
    decided.write_text("[ignore]\n")
    assert watch.hears("a.obj", BUILT).why == "'a.overrides.toml' has changed"
    decided.unlink()
    assert watch.hears("a.obj", BUILT).why == "'a.overrides.toml' has changed"


def test_a_half_written_mesh_is_built_when_it_is_whole(watch, tmp_path):
    (tmp_path / "b.obj").write_bytes(TRIANGLE + b"broken")
    watch.hears("b.obj", FAILED)
    (tmp_path / "a.obj").write_bytes(TRIANGLE + b"\n")
    watch.hears("a.obj", BUILT)
    (tmp_path / "b.obj").write_bytes(TRIANGLE)
    watch.hears("b.obj", BUILT)


def test_a_fault_is_said_once(watch, tmp_path):
    (tmp_path / "b.obj").write_bytes(b"broken")
    watch.hears("b.obj", FAILED)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "c.obj").write_bytes(TRIANGLE)
    watch.until(lambda: [one for one in watch.heard if one.asset == "elsewhere/c.obj"])
    assert [one.asset for one in watch.heard] == ["elsewhere/c.obj"]
    assert watch.maker.made.count("b.obj") <= 2  # a change elsewhere is none of it


def test_a_fault_that_is_taken_back_is_said(watch, tmp_path):
    (tmp_path / "a.obj").write_bytes(b"broken")
    watch.hears("a.obj", FAILED)
    (tmp_path / "a.obj").write_bytes(TRIANGLE)
    found = watch.hears("a.obj", CURRENT)
    assert line_of(found) == (
        "a.obj: current: good, 64 triangles, recall 90.00 %, precision 99.00 %, overhang 0.40 %"
    )


def test_a_renamed_mesh_is_built_and_its_old_occluder_stays(watch, tmp_path):
    (tmp_path / "a.obj").rename(tmp_path / "z.obj")
    watch.until(lambda: {one.state for one in watch.heard} == {BUILT, GONE})
    assert (tmp_path / "z_occluder.glb").exists()
    assert (tmp_path / "a_occluder.glb").exists()


def test_a_bad_manifest_is_said_and_mended(watch, tmp_path):
    write(tmp_path, SETTINGS + "budgte = 3\n")
    words = "occluders.toml:3: 'budgte' is not known"
    watch.until(lambda: any(words in str(one) for one in watch.heard))
    watch.heard.clear()
    write(tmp_path, SETTINGS + "budget = 3\n")
    assert watch.hears("a.obj", BUILT).why == "budget was 64 and is 3"


def test_an_occluder_that_somebody_removes_comes_back(watch, tmp_path):
    (tmp_path / "a_occluder.glb").unlink()
    assert watch.hears("a.obj", BUILT).why == "'a_occluder.glb' is missing"


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ManifestError, match="there is no such folder; check the path"):
        watch_assets(
            tmp_path / "none" / "occluders.toml", threading.Event(), found=print, refused=print
        )


def test_what_changes_before_the_watch_has_begun_is_seen(tmp_path):
    """While the first build runs nobody watches yet."""
    manifest, changed = write(tmp_path, a=TRIANGLE), threading.Event()

    class Meanwhile(QuickMaker):
        def __call__(self, job):
            if not changed.is_set():
                changed.set()
                (tmp_path / "b.obj").write_bytes(TRIANGLE)
            return super().__call__(job)

    watch = Watch(manifest, Meanwhile())
    watch.hears("b.obj", BUILT)
    watch.end()
