"""Shards by what farms run: an Open Job Description template, and Slurm as a stub of its sbatch."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from simplifier.builds.shards import shard_number
from tests.acceptance.command import ROOT, environment
from tests.acceptance.test_build import QUICK, save
from tests.integrations.commands import make_command
from tests.solids import box

FARM = ROOT / "examples" / "farm"
TEMPLATE = FARM / "occluders.openjd.yaml"
OPENJD = Path(sys.executable).with_name("openjd")
NAMES = ["props/box.ply", "props/hut.ply"]

SBATCH = """#!/bin/sh
# Runs at once what it is given, as Slurm would later; jobs are numbered from 1.
cat > script.$$
array= dependency=
for option; do
    case $option in
        --array=*) array=$(echo "${option#--array=}" | tr - ' ') ;;
        --dependency=afterok:*) dependency=${option#--dependency=afterok:} ;;
    esac
done
job=$(($(ls -d "$SPOOL"/job.* 2> /dev/null | wc -l) + 1))
mkdir "$SPOOL/job.$job"
mv script.$$ "$SPOOL/job.$job/script"
echo "$@" > "$SPOOL/job.$job/options"
if test -n "$dependency" && test -e "$SPOOL/job.$dependency/failed"; then
    touch "$SPOOL/job.$job/never"
elif test -n "$array"; then
    for task in $(seq $array); do
        SLURM_ARRAY_TASK_ID=$task sh "$SPOOL/job.$job/script" > "$SPOOL/job.$job/$task.log" 2>&1 \\
            || touch "$SPOOL/job.$job/failed"
    done
else
    sh "$SPOOL/job.$job/script" > "$SPOOL/job.$job/log" 2>&1 || touch "$SPOOL/job.$job/failed"
fi
echo "$job;farm"
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A PATH on which ``occluder`` is this checkout's, and ``sbatch`` the stub."""
    folder = tmp_path_factory.mktemp("bin")
    make_command(folder)
    (folder / "sbatch").write_text(SBATCH)
    (folder / "sbatch").chmod(0o755)
    return os.pathsep.join([str(folder), os.environ["PATH"]])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("shared art")
    (place / "occluders.toml").write_text(QUICK)
    for name in NAMES:
        save(box(), place / name)
    assert {shard_number(name, 2) for name in NAMES} == {1, 2}
    return place


def run_template(folder, path, *arguments):
    return subprocess.run(
        [OPENJD, "run", TEMPLATE, "-p", f"Manifest={folder}/occluders.toml", *arguments],
        env=environment(PATH=path), capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def entries(folder):
    return json.loads((folder / "occluders.lock").read_text())["assets"]


def test_the_template_builds_shards_and_joins_them(folder, path):
    done = run_template(folder, path, "-p", "Shards=2")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("1 asset: 1 built") == 2
    assert "2 assets: 2 built" in done.stdout
    assert sorted(entries(folder)) == NAMES


def test_slurm_builds_shards_and_joins_them_unless_one_has_failed(folder, path, tmp_path):
    """Where the test before this one was not run all is made here."""
    for name in folder.glob("props/hut_occluder.*"):
        name.unlink()
    done = submit(folder, path, tmp_path)
    assert done.stdout == "shards: 1, join: 2\n"
    assert not (tmp_path / "job.2/failed").exists(), (tmp_path / "job.2/log").read_text()
    assert "2 assets: " in (tmp_path / "job.2/log").read_text()
    assert sorted(entries(folder)) == NAMES
    assert (folder / "props/hut_occluder.glb").is_file()
    assert not list(folder.glob("script.*"))
    options = (tmp_path / "job.1/options").read_text()
    assert "--array=1-2 " in options
    assert options.endswith(" --partition=night\n")

    (folder / "props/hut.ply").write_bytes(b"ply\n")
    submit(folder, path, tmp_path)
    assert (tmp_path / "job.3/failed").exists()
    assert (tmp_path / "job.4/never").exists()


def submit(folder, path, spool):
    return subprocess.run(
        [FARM / "slurm.sh", folder / "occluders.toml", "2", "--partition=night"],
        env=environment(PATH=path, SPOOL=str(spool)), capture_output=True, text=True,
        timeout=120, check=True,
    )  # fmt: skip


def test_the_template_asks_hosts_for_what_the_script_asks_of_slurm():
    build = yaml.safe_load(TEMPLATE.read_text())["steps"][0]
    wanted = {one["name"]: one["min"] for one in build["hostRequirements"]["amounts"]}
    script = (FARM / "slurm.sh").read_text()
    assert f"--cpus-per-task={wanted['amount.worker.vcpu']} " in script
    assert f"--mem={wanted['amount.worker.memory'] // 1024}G " in script
