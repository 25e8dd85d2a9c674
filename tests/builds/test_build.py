"""What is made and what is not, by a maker that takes no time."""

from __future__ import annotations

import os
import shutil
import threading
import time
from dataclasses import replace
from hashlib import sha256

import pytest

from simplifier.builds import staleness
from simplifier.builds.build import build_assets
from simplifier.builds.holding import whole_build
from simplifier.builds.record import read_record, write_record
from simplifier.builds.staleness import check_assets
from simplifier.errors import CancelledError, ManifestError, OutputError
from tests.builds.quick import (
    BUILT,
    CURRENT,
    FAILED,
    GONE,
    SETTINGS,
    STALE,
    TRIANGLE,
    QuickMaker,
    run,
    states,
    write,
)


@pytest.fixture
def built(tmp_path):
    """A manifest of two assets, built."""
    manifest = write(tmp_path, a=TRIANGLE, props__b=TRIANGLE)
    assert states(run(manifest)) == {"a.obj": BUILT, "props/b.obj": BUILT}
    return manifest


def outputs(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*occluder*.*")
                  if path.suffix not in (".toml", ".lock"))  # fmt: skip


def test_what_is_current_is_not_made_again(built):
    before = built.with_suffix(".lock").stat()
    maker = QuickMaker()
    assert states(run(built, maker)) == {"a.obj": CURRENT, "props/b.obj": CURRENT}
    assert maker.made == []
    assert built.with_suffix(".lock").stat().st_mtime_ns == before.st_mtime_ns
    assert outputs(built.parent) == ["a_occluder.glb", "props/b_occluder.glb"]


def changed_mesh(folder):
    (folder / "a.obj").write_bytes(TRIANGLE + b"# 0.8\n")


def changed_output(folder):
    (folder / "a_occluder.glb").write_bytes(b"other")


def missing_output(folder):
    (folder / "a_occluder.glb").unlink()


def changed_option(folder):
    write(folder, SETTINGS + "[[asset]]\nfiles = 'a.obj'\nbudget = 32\n")


def option_and_its_rival(folder):
    write(folder, SETTINGS + "[[asset]]\nfiles = 'a.obj'\nerror_bound = 0.5\n")


def another_output(folder):
    write(folder, SETTINGS + "[[asset]]\nfiles = 'a.obj'\noutput = 'x.glb'\n")


def another_way_to_write(folder):
    written = "{ file = '{name}_occluder.glb', sides = 'single' }"
    write(folder, SETTINGS + f"[[asset]]\nfiles = 'a.obj'\noutput = {written}\n")


def new_overrides(folder):
    (folder / "a.overrides.toml").write_text("[ignore]\n")


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (changed_mesh, "the mesh has changed"),
        (changed_output, "'a_occluder.glb' was changed"),
        (missing_output, "'a_occluder.glb' is missing"),
        (changed_option, "budget was 64 and is 32"),
        (option_and_its_rival, "error_bound was not set and is 0.5"),
        (another_output, "'a_occluder.glb' is no more an output"),
        (another_way_to_write, "'a_occluder.glb': sides was double and is single"),
        (new_overrides, "'a.overrides.toml' has changed"),
    ],
)
def test_a_change_makes_its_asset_and_no_other(built, change, why):
    change(built.parent)
    found = {one.asset: one for one in check_assets(built, {})}
    assert states(found) == {"a.obj": STALE, "props/b.obj": CURRENT}
    assert found["a.obj"].why == why
    found = run(built)
    assert states(found) == {"a.obj": BUILT, "props/b.obj": CURRENT}
    assert found["a.obj"].why == why
    assert set(states(run(built)).values()) == {CURRENT}
    assert len(outputs(built.parent)) + (built.parent / "x.glb").exists() == 2


def test_another_version_makes_all(built, monkeypatch):
    monkeypatch.setattr(staleness, "VERSION", "99")
    found = {one.asset: one for one in check_assets(built, {})}
    assert found["a.obj"].why.endswith("made it, and this is 99")
    assert states(found) == {"a.obj": STALE, "props/b.obj": STALE}


def test_a_touched_file_is_the_same(built):
    os.utime(built.parent / "a.obj", (1, 1))
    shutil.copy(built.parent / "a_occluder.glb", built.parent / "copy")
    (built.parent / "copy").replace(built.parent / "a_occluder.glb")
    assert set(states(run(built)).values()) == {CURRENT}


def test_files_that_git_lfs_has_not_fetched_count_as_what_they_stand_for(built):
    files = [path for path in built.parent.rglob("*") if path.suffix in (".obj", ".glb")]
    contents = {path: path.read_bytes() for path in files}
    for path, data in contents.items():
        path.write_text(
            f"version https://git-lfs.github.com/spec/v1\noid sha256:{sha256(data).hexdigest()}\n"
            f"size {len(data)}\n"
        )
    assert {one.state for one in check_assets(built, {})} == {CURRENT}
    files[0].write_text(files[0].read_text().replace("sha256:", "sha256:0")[:-3])
    assert {one.state for one in check_assets(built, {})} == {CURRENT, STALE}


def test_a_buffer_beside_the_mesh_counts(tmp_path):
    text = "[[asset]]\nfiles = '*.gltf'\n"
    (tmp_path / "a.gltf").write_text(
        '{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 3, "uri": "data%201.bin"}]}'
    )
    (tmp_path / "data 1.bin").write_bytes(b"abc")
    manifest = write(tmp_path, text)
    run(manifest)
    assert list(read_record(manifest.with_suffix(".lock"))["a.gltf"].beside) == ["data 1.bin"]
    (tmp_path / "data 1.bin").write_bytes(b"abd")
    assert run(manifest)["a.gltf"].why == "'data 1.bin' has changed"


def test_a_material_file_that_an_obj_names_counts_also_when_it_was_not_there(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nmtllib ../b.mtl\nv 0 0 0\nf 1 1 1\n")
    manifest = write(tmp_path, "[[asset]]\nfiles = '*.obj'\n")
    run(manifest)
    beside = dict(read_record(manifest.with_suffix(".lock"))["a.obj"].beside)
    assert beside == {"a.mtl": ""}
    (tmp_path / "a.mtl").write_text("newmtl glass\nd 0.1\n")
    assert run(manifest)["a.obj"].why == "'a.mtl' has changed"
    assert states(run(manifest)) == {"a.obj": CURRENT}


def test_overrides_count_while_they_are_there(built):
    place = built.parent / "props/b.overrides.toml"
    for change in (
        lambda: place.write_text("[ignore]\n"),
        lambda: place.write_text(""),
        place.unlink,
    ):
        change()
        assert run(built)["props/b.obj"].why == "'b.overrides.toml' has changed"
        assert set(states(run(built)).values()) == {CURRENT}


def test_one_that_fails_costs_no_other_and_is_tried_again(built):
    (built.parent / "a.obj").write_bytes(b"broken")
    (built.parent / "c.obj").write_bytes(TRIANGLE)
    for third in (BUILT, CURRENT):
        found = run(built)
        assert states(found) == {"a.obj": FAILED, "c.obj": third, "props/b.obj": CURRENT}
        assert "it is broken; mend it" in found["a.obj"].why
    assert (built.parent / "a_occluder.glb").read_bytes() == TRIANGLE  # the last good one


def test_a_mesh_that_changes_while_it_is_read_is_not_taken(built):
    (built.parent / "a.obj").write_bytes(b"new")

    def maker(job):
        job.mesh.write_bytes(b"newer")
        return QuickMaker()(job)

    found = run(built, maker)["a.obj"]
    assert found.state is FAILED
    assert "changed while it was read" in found.why
    assert (built.parent / "a_occluder.glb").read_bytes() == TRIANGLE


def test_an_output_that_cannot_be_written_costs_its_asset(tmp_path):
    manifest = write(tmp_path, a=TRIANGLE, b=TRIANGLE)
    (tmp_path / "a_occluder.glb").mkdir()
    found = run(manifest)
    assert states(found) == {"a.obj": FAILED, "b.obj": BUILT}
    assert "this is a folder" in found["a.obj"].why


def test_levels_that_are_no_more_are_removed(tmp_path):
    manifest = write(tmp_path, "[defaults]\nlods = 3\n" + SETTINGS, a=TRIANGLE)
    run(manifest)
    assert outputs(tmp_path) == ["a_occluder.glb", *(f"a_occluder_lod{i}.glb" for i in range(3))]
    write(tmp_path, "[defaults]\nlods = 2\noutput = '{name}_occluder.tres'\n" + SETTINGS)
    assert run(manifest)["a.obj"].why == "lods was 3 and is 2"
    assert outputs(tmp_path) == ["a_occluder_lod0.tres", "a_occluder_lod1.tres"]
    assert run(manifest)["a.obj"].state is CURRENT


def test_what_was_made_of_a_mesh_that_is_gone_goes_too(built):
    (built.parent / "a.obj").unlink()
    found = {one.asset: one for one in check_assets(built, {})}
    assert states(found) == {"a.obj": GONE, "props/b.obj": CURRENT}
    assert found["a.obj"].faults
    assert states(run(built)) == {"props/b.obj": CURRENT}
    assert outputs(built.parent) == ["props/b_occluder.glb"]
    assert list(read_record(built.with_suffix(".lock"))) == ["props/b.obj"]


def test_what_somebody_changed_is_not_removed(built):
    (built.parent / "a.obj").unlink()
    (built.parent / "a_occluder.glb").write_bytes(b"by hand")
    run(built)
    assert (built.parent / "a_occluder.glb").read_bytes() == b"by hand"


def test_a_renamed_mesh_takes_its_occluder_along(built):
    (built.parent / "a.obj").rename(built.parent / "z.obj")
    assert states(run(built)) == {"props/b.obj": CURRENT, "z.obj": BUILT}
    assert outputs(built.parent) == ["props/b_occluder.glb", "z_occluder.glb"]


def test_requirements_are_judged_whether_or_not_it_was_made_now(built):
    write(built.parent, SETTINGS + "require = { min_recall = 0.95 }\n")
    for found in (run(built)["a.obj"], check_assets(built, {})[0]):
        assert found.state is CURRENT
        assert found.faults == ("recall 90 % is below 95 %",)


def test_what_an_old_record_does_not_tell_is_made_again_once_it_is_demanded(built):
    lock = built.with_suffix(".lock")
    old = {
        name: replace(entry, figures=replace(entry.figures, overhang=None, verdict=None))
        for name, entry in read_record(lock).items()
    }
    write_record(lock, old)
    assert set(states(run(built)).values()) == {CURRENT}
    write(built.parent, SETTINGS + "require = { max_overhang = 0.001 }\n")
    stale = check_assets(built, {})[0]
    assert stale.faults == ("stale: its record is from before the overhang was kept",)
    found = run(built)["a.obj"]
    assert (found.state, found.faults) == (BUILT, ("overhang 0.4 % is above 0.1 %",))


def test_recall_is_compared_with_what_was(built):
    before = read_record(built.with_suffix(".lock"))
    changed_mesh(built.parent)  # and its recall with it
    assert run(built, before=before)["a.obj"].faults == ("recall fell from 90 % to 80 %",)
    assert [one.short for one in check_assets(built, before)] == [
        ("recall fell from 90 % to 80 %",),
        (),
    ]
    assert [one.short for one in check_assets(built, {})] == [(), ()]


def test_two_builds_of_a_folder_are_kept_apart(built):
    with (
        whole_build(built.parent),
        pytest.raises(OutputError, match="another build of this folder"),
    ):
        run(built)
    assert set(states(run(built)).values()) == {CURRENT}


def test_a_cancelled_build_keeps_what_was_made(tmp_path):
    meshes = {f"m{i}": TRIANGLE for i in range(6)}
    manifest, cancel, quick = write(tmp_path, **meshes), threading.Event(), QuickMaker()

    def maker(job):
        if job.mesh.name == "m3.obj":
            cancel.set()
        if cancel.is_set():
            raise CancelledError("cancelled")
        return quick(job)

    found = {one.asset: one for one in build_assets(manifest, cancel, maker=maker, at_once=1)}
    done = {name for name, one in found.items() if one.state is BUILT}
    assert done <= {"m0.obj", "m1.obj", "m2.obj"}
    assert {one.state for one in found.values()} <= {BUILT, STALE}
    assert set(read_record(manifest.with_suffix(".lock"))) == done
    assert sum(one.state is BUILT for one in run(manifest).values()) == len(meshes) - len(done)


def test_drafts_of_killed_runs_are_removed_and_those_of_others_are_not(built):
    old, young = (built.parent / f".occluder-{name}.tmp" for name in ("old", "young"))
    old.touch()
    young.touch()
    os.utime(old, (time.time() - 3600,) * 2)
    changed_mesh(built.parent)
    run(built)
    assert not old.exists()
    assert young.exists()


def test_a_lost_record_makes_all_anew(built):
    built.with_suffix(".lock").unlink()
    assert set(states(run(built)).values()) == {BUILT}


def test_a_damaged_record_is_refused_before_anything_is_made(built):
    built.with_suffix(".lock").write_text("{}")
    maker = QuickMaker()
    with pytest.raises(ManifestError, match="not a record of a build"):
        run(built, maker)
    assert maker.made == []


def test_the_share_that_is_done_is_told(tmp_path):
    told = []
    manifest = write(tmp_path, a=TRIANGLE, b=TRIANGLE)
    run(manifest, tell=lambda done, total: told.append((done, total)))
    assert told == [(0, 2), (1, 2), (2, 2)]


def test_an_output_that_another_asset_takes_over_is_not_removed(tmp_path):
    """Two meshes of the same content swap their outputs."""
    swapped = SETTINGS + "output = '{}.glb'\n[[asset]]\nfiles = 'b.obj'\noutput = '{}.glb'\n"
    manifest = write(tmp_path, swapped.format("x", "y"), a=TRIANGLE, b=TRIANGLE)
    run(manifest, at_once=1)
    write(tmp_path, swapped.format("y", "x"))
    assert set(states(run(manifest, at_once=1)).values()) == {BUILT}
    assert set(states(run(manifest)).values()) == {CURRENT}


def test_a_maker_elsewhere_has_256_assets_under_way_and_no_more(tmp_path):
    manifest = write(tmp_path, **{f"m{i}": TRIANGLE for i in range(600)})
    quick, lock, under_way, most = QuickMaker(), threading.Lock(), 0, 0
    full = threading.Event()

    def maker(job):
        nonlocal under_way, most
        with lock:
            under_way += 1
            most = max(most, under_way)
        if most == 256:
            full.set()
        assert full.wait(60)
        try:
            return quick(job)
        finally:
            with lock:
                under_way -= 1

    assert set(states(run(manifest, maker)).values()) == {BUILT}
    assert most == 256
