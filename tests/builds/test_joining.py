"""Shards by a maker that takes no time: what comes of them is what a whole build makes."""

from __future__ import annotations

import json
import shutil
import threading

import pytest

from simplifier.builds import joining
from simplifier.builds.build import build_assets
from simplifier.builds.joining import join_shards
from simplifier.builds.record import read_record
from simplifier.builds.shard_record import shard_path, shards_folder
from simplifier.builds.shards import Shard, shard_number
from simplifier.builds.staleness import check_assets
from simplifier.errors import ManifestError
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

COUNT = 3
SHARDS = [Shard(i + 1, COUNT) for i in range(COUNT)]
MESHES = {f"m{i}": TRIANGLE + f"# 0.{i}\n".encode() for i in range(1, 9)}


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*")
            if path.is_file() and path.name != ".occluder-build.lock"}  # fmt: skip


def of_shard(shard):
    return {f"{name}.obj" for name in MESHES if shard.holds(f"{name}.obj")}


def build_shards(manifest, shards=SHARDS, maker=None):
    found = {}
    for shard in shards:
        found |= run(manifest, maker, shard=shard)
    return found


def joined(manifest, before=None):
    return {one.asset: one for one in join_shards(manifest, before or {})}


@pytest.fixture
def manifest(tmp_path):
    (tmp_path / "sharded").mkdir()
    return write(tmp_path / "sharded", **MESHES)


@pytest.fixture
def whole(tmp_path, manifest):
    """The same, built as a whole: its files."""
    folder = tmp_path / "whole"
    shutil.copytree(manifest.parent, folder)
    run(folder / manifest.name)
    return contents(folder)


def test_what_shards_make_is_what_a_whole_build_makes(manifest, whole):
    maker = QuickMaker()
    for shard in SHARDS:
        assert states(run(manifest, maker, shard=shard)) == dict.fromkeys(of_shard(shard), BUILT)
        assert not manifest.with_suffix(".lock").exists()
    assert sorted(maker.made) == sorted(f"{name}.obj" for name in MESHES)
    found = joined(manifest)
    assert states(found) == dict.fromkeys(sorted(found), BUILT)
    assert {one.why for one in found.values()} == {"it was never made"}
    assert contents(manifest.parent) == whole
    assert set(states(run(manifest)).values()) == {CURRENT}


def test_what_is_current_is_not_made_again_and_changed_ones_are(manifest, whole):
    build_shards(manifest)
    joined(manifest)
    (manifest.parent / "m1.obj").write_bytes(TRIANGLE)
    maker = QuickMaker()
    found = build_shards(manifest, maker=maker)
    assert maker.made == ["m1.obj"]
    assert found["m1.obj"].why == "the mesh has changed"
    found = joined(manifest)
    assert {name for name, one in found.items() if one.state is BUILT} == {"m1.obj"}
    assert found["m1.obj"].why == "the mesh has changed"


def test_joined_twice_changes_nothing(manifest, whole):
    build_shards(manifest)
    joined(manifest)
    assert set(states(joined(manifest)).values()) == {CURRENT}
    assert contents(manifest.parent) == whole
    (manifest.parent / "m1.obj").write_bytes(TRIANGLE)
    with pytest.raises(ManifestError, match=r"no records of shards in 'occluders\.shards'; run"):
        joined(manifest)


@pytest.mark.parametrize("moment", ["write_record", "remove_shard_records"])
def test_a_join_that_ends_halfway_is_done_again(manifest, whole, monkeypatch, moment):
    def stop(*_):
        raise KeyboardInterrupt

    build_shards(manifest)
    with monkeypatch.context() as broken:
        broken.setattr(joining, moment, stop)
        with pytest.raises(KeyboardInterrupt):
            joined(manifest)
    assert set(states(joined(manifest)).values()) == {BUILT}
    assert contents(manifest.parent) == whole


def test_a_join_without_one_says_which_and_changes_nothing(manifest):
    build_shards(manifest, SHARDS[:1])
    before = contents(manifest.parent)
    with pytest.raises(ManifestError) as refused:
        joined(manifest)
    assert str(refused.value) == (
        f"{shards_folder(manifest)}: shard 2/3, 3/3 has no record here; run: occluder build "
        f"{manifest} --shard 2/3, or bring its outputs and '2-of-3.json' here"
    )
    assert contents(manifest.parent) == before


def cancelled_shard(manifest, shard):
    """It ends after an asset; what it made."""
    cancel, quick = threading.Event(), QuickMaker()

    def maker(job):
        cancel.set()
        return quick(job)

    build_assets(manifest, cancel, maker=maker, at_once=1, shard=shard)
    return quick.made


def test_a_shard_that_did_not_end_is_refused_and_goes_on(manifest, whole):
    large = max(SHARDS, key=lambda one: len(of_shard(one)))
    build_shards(manifest, [one for one in SHARDS if one != large])
    made = cancelled_shard(manifest, large)
    assert 0 < len(made) < len(of_shard(large))
    with pytest.raises(ManifestError, match=f"shard {large} did not come to its end; run"):
        joined(manifest)
    kept = set(read_shard_entries(manifest, large))
    assert kept <= set(made)
    maker = QuickMaker()
    run(manifest, maker, shard=large)
    assert set(maker.made) == of_shard(large) - kept
    assert set(states(joined(manifest)).values()) == {BUILT}
    assert contents(manifest.parent) == whole


def read_shard_entries(manifest, shard):
    return json.loads(shard_path(manifest, shard).read_text())["assets"]


def test_a_check_of_a_shard_looks_at_it_alone(manifest):
    run(manifest, shard=SHARDS[0])
    for shard, state in zip(SHARDS, (CURRENT, STALE, STALE), strict=True):
        found = check_assets(manifest, {}, shard)
        assert {one.asset: one.state for one in found} == dict.fromkeys(of_shard(shard), state)


def another_manifest(manifest):
    manifest.write_text(SETTINGS + "# another\n")
    return "was built of another 'occluders.toml'"


def another_count(manifest):
    shutil.copy(shard_path(manifest, SHARDS[0]), manifest.parent / "kept.json")
    shutil.rmtree(shards_folder(manifest))
    run(manifest, shard=Shard(1, 4))
    shutil.move(manifest.parent / "kept.json", shard_path(manifest, SHARDS[0]))
    return "there are records of 3 and of 4 shards; remove"


def a_copy(manifest):
    shutil.copy(shard_path(manifest, SHARDS[0]), shards_folder(manifest) / "copy.json")
    return "shard 1/3 is recorded twice, in '1-of-3.json' and 'copy.json'; remove one"


def a_new_mesh(manifest):
    (manifest.parent / "new.obj").write_bytes(TRIANGLE)
    shard = Shard(shard_number("new.obj", COUNT), COUNT)
    return f"'new.obj' of shard {shard} is not in its record: meshes came or went"


def a_mesh_that_went(manifest):
    (manifest.parent / "m1.obj").unlink()
    shard = Shard(shard_number("m1.obj", COUNT), COUNT)
    return f"'m1.obj' of shard {shard} is not an asset here: meshes came or went"


def damage(manifest):
    shard_path(manifest, SHARDS[1]).write_text("{}")
    return "2-of-3.json: this is not a record of a shard; remove it and build the shard again"


def another_version(manifest):
    change(manifest, version="0.0.0")
    return "shard 2/3 was built by version 0.0.0, and this is "


def an_asset_of_another_shard(manifest):
    change(manifest, failed={"m8.obj": "strange"})
    assert not SHARDS[1].holds("m8.obj")
    return "shard 2/3 has 'm8.obj', which is of shard "


def change(manifest, **members):
    path = shard_path(manifest, SHARDS[1])
    path.write_text(json.dumps({**json.loads(path.read_text()), **members}))


@pytest.mark.parametrize(
    "harm",
    [another_manifest, another_count, a_copy, a_new_mesh, a_mesh_that_went, damage,
     another_version, an_asset_of_another_shard],
)  # fmt: skip
def test_records_that_do_not_belong_together_are_refused(manifest, harm):
    build_shards(manifest)
    message = harm(manifest)
    before = contents(manifest.parent)
    with pytest.raises(ManifestError) as refused:
        joined(manifest)
    assert message in str(refused.value)
    assert contents(manifest.parent) == before


def test_a_shard_of_another_number_is_refused_at_its_start(manifest):
    build_shards(manifest, SHARDS[:1])
    with pytest.raises(ManifestError, match=r"1-of-3\.json: there is a record of one of 3 shards"):
        run(manifest, shard=Shard(1, 4))


def test_line_ends_make_no_other_manifest(manifest):
    build_shards(manifest)
    manifest.write_bytes(manifest.read_bytes().replace(b"\n", b"\r\n"))
    assert set(states(joined(manifest)).values()) == {BUILT}


def test_one_that_failed_in_its_shard_is_told_and_costs_no_other(manifest):
    build_shards(manifest)
    joined(manifest)
    (manifest.parent / "m1.obj").write_bytes(b"broken")
    assert build_shards(manifest)["m1.obj"].state is FAILED
    found = joined(manifest)
    assert states(found)["m1.obj"] is FAILED
    assert found["m1.obj"].faults == run(manifest)["m1.obj"].faults
    assert set(read_record(manifest.with_suffix(".lock"))) == set(found)  # the last good one


def test_outputs_that_were_not_brought_are_told(manifest):
    build_shards(manifest)
    (manifest.parent / "m1_occluder.glb").unlink()
    assert joined(manifest)["m1.obj"].faults == ("stale: 'm1_occluder.glb' is missing",)
    assert run(manifest)["m1.obj"].state is BUILT


def test_thresholds_hold_in_a_shard_and_after_the_join(manifest):
    write(manifest.parent, SETTINGS + "require = { min_recall = 0.75 }\n")
    low = {f"m{i}.obj": (f"recall {10 * i} % is below 75 %",) for i in range(1, 8)}
    build_shards(manifest)
    for found in (build_shards(manifest), joined(manifest)):
        assert {name: one.faults for name, one in found.items() if one.faults} == low


def test_recall_is_compared_with_what_was(manifest):
    build_shards(manifest)
    joined(manifest)
    before = read_record(manifest.with_suffix(".lock"))
    (manifest.parent / "m8.obj").write_bytes(TRIANGLE + b"# 0.5\n")
    build_shards(manifest)
    assert joined(manifest, before)["m8.obj"].faults == ("recall fell from 80 % to 50 %",)


def test_what_is_gone_is_removed_by_the_join(manifest):
    build_shards(manifest)
    joined(manifest)
    (manifest.parent / "m1.obj").unlink()
    build_shards(manifest)
    assert (manifest.parent / "m1_occluder.glb").exists()
    assert GONE not in states(joined(manifest)).values()
    assert not (manifest.parent / "m1_occluder.glb").exists()
    assert "m1.obj" not in read_record(manifest.with_suffix(".lock"))


def test_outputs_of_another_name_take_the_place_of_those_of_another_machine(manifest, tmp_path):
    build_shards(manifest)
    joined(manifest)
    write(manifest.parent, SETTINGS + "output = 'made/{name}.glb'\n")
    far = tmp_path / "far"
    shutil.copytree(manifest.parent, far)
    build_shards(manifest, SHARDS[:1])
    build_shards(far / manifest.name, SHARDS[1:])
    shutil.copytree(far / "made", manifest.parent / "made", dirs_exist_ok=True)
    shutil.copytree(shards_folder(far / manifest.name), shards_folder(manifest), dirs_exist_ok=True)
    joined(manifest)
    assert not list(manifest.parent.glob("*_occluder.glb"))
    assert len(list((manifest.parent / "made").iterdir())) == len(MESHES)
