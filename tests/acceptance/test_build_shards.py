"""``occluder build`` in shards, as a farm runs it: at once, killed, on machines of their own."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import xml.etree.ElementTree as ET

import pytest

from simplifier.builds.shards import Shard
from tests import solids
from tests.acceptance.command import OCCLUDER, environment
from tests.acceptance.test_build import QUICK, contents, save
from tests.waiting import until

pytestmark = pytest.mark.usefixtures("making_here")
"""Of builds by the command in this process; others start what they start."""

NAMES = [f"props/{name}.ply" for name in ("box", "ball", "torus", "tube", "hut", "barn", "mill")]
SHAPES = (solids.box, solids.sphere, solids.torus)


@pytest.fixture
def folder(tmp_path):
    """Meshes and their manifest."""
    place = tmp_path / "shared"
    for i, name in enumerate(NAMES):
        save(SHAPES[i % len(SHAPES)](), place / name)
    (place / "occluders.toml").write_text(QUICK)
    return place


def start(folder, *arguments):
    return subprocess.Popen(
        [*OCCLUDER, "build", *arguments], cwd=folder, env=environment(), text=True,
        stderr=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip


def test_shards_of_a_farm_make_what_one_build_makes(folder, tmp_path, here):
    """Two at once in a shared folder, one of them killed halfway, and one on another machine."""
    first, second, far_one = (Shard(i + 1, 3) for i in range(3))
    assert sum(map(first.holds, NAMES)) >= 3
    assert any(map(second.holds, NAMES))
    assert any(map(far_one.holds, NAMES))
    whole, far = tmp_path / "whole", tmp_path / "far"
    shutil.copytree(folder, whole)
    shutil.copytree(folder, far)
    record = folder / "occluders.shards/1-of-3.json"

    with start(folder, "--shard", "1/3", "--at-once", "1") as killed:
        until(lambda: record.exists() and json.loads(record.read_text())["assets"], 60.0)
        killed.send_signal(signal.SIGSTOP)  # else it may have come to its end by then
        refused = here("build", cwd=folder)
        assert refused.returncode == 1
        assert "another build of this folder is running; wait for its end" in refused.stderr
        twice = here("build", "--shard", "1/3", cwd=folder)
        assert "another build of shard 1/3 of this folder is running" in twice.stderr
        with start(folder, "--shard", "2/3", "--at-once", "1") as beside:
            killed.kill()
            assert beside.wait(60) == 0, beside.stderr.read()
    unfinished = here("build", "--join", cwd=folder)
    assert unfinished.returncode == 1
    assert "shard 3/3 has no record here" in unfinished.stderr
    done = here("build", "--shard", "3/3", cwd=far)
    assert done.returncode == 0, done.stderr
    shutil.copytree(far, folder, dirs_exist_ok=True)
    unfinished = here("build", "--join", cwd=folder)
    assert "shard 1/3 did not come to its end; run: occluder build occluders.toml --shard 1/3" in (
        unfinished.stderr
    )
    again = here("build", "--shard", "1/3", "--junit", "j.xml", cwd=folder)
    assert " current, " in again.stdout, again.stderr
    suite = ET.parse(folder / "j.xml").find("testsuite")
    assert suite.get("name") == "occluders.toml (shard 1/3)"
    assert len(suite) == sum(map(first.holds, NAMES))
    assert here("build", "--check", "--shard", "1/3", cwd=folder).returncode == 0
    (folder / "j.xml").unlink()

    joined = here("build", "--join", "--json", tmp_path / "j.json", cwd=folder)
    assert joined.returncode == 0, joined.stderr
    assert "7 assets: 7 built" in joined.stdout
    assets = json.loads((tmp_path / "j.json").read_text())["assets"]
    assert [one["asset"] for one in assets] == sorted(NAMES)
    assert all(one["seconds"] > 0.0 and one["figures"]["triangles"] for one in assets)
    assert here("build", cwd=whole).returncode == 0
    assert contents(folder) == contents(whole)
    twice = here("build", "--join", cwd=folder)
    assert (twice.returncode, twice.stdout) == (0, "7 assets: 7 current\n")
    assert here("build", "--check", cwd=folder).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--shard", "0/4"), "error: shard: '0/4' is not a shard; write I/N, with I from 1 to N"),
        (("--shard", "many"), "error: shard: 'many' is not a shard; write I/N"),
        (("--join", "--shard", "1/4"), "error: join: a join makes nothing, so it cannot be given "
         "with --shard; give --join alone"),
        (("--join", "--check"), "cannot be given with --check"),
        (("--join", "--server", "http://127.0.0.1:1"), "cannot be given with --server"),
    ],
)  # fmt: skip
def test_wrong_usage_is_one_line_and_writes_nothing(folder, here, arguments, message):
    before = contents(folder)
    done = here("build", *arguments, cwd=folder)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert contents(folder) == before


def test_a_join_without_shards_says_what_to_run(folder, here):
    done = here("build", "--join", cwd=folder)
    assert done.returncode == 1
    assert done.stderr == (
        "error: occluders.toml: there are no records of shards in 'occluders.shards'; "
        "run 'occluder build --shard 1/N' and so on to N/N first, or bring what they wrote here\n"
    )
