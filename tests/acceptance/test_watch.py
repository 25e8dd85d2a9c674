"""``occluder watch`` as its users run it, from the first build to Ctrl-C."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import threading
from contextlib import contextmanager

import pytest

import simplifier
from tests import solids
from tests.acceptance.command import OCCLUDER, ROOT, environment, occluder
from tests.service.declared import declare
from tests.service.real import running
from tests.waiting import until

MANIFEST = """
[defaults]
resolution = 12
moves = 40
views = 4
image = 32

[[asset]]
files = "props/*.ply"
"""


@pytest.fixture
def watching(tmp_path):
    """The process and the lines of its standard output and error, of a folder with one mesh."""
    fill(tmp_path)
    with watch(tmp_path) as (process, lines):
        yield process, lines


def fill(folder):
    (folder / "props").mkdir()
    (folder / "occluders.toml").write_text(MANIFEST)
    save(solids.box(), folder / "props/box.ply")


@contextmanager
def watch(folder, *arguments, **variables):
    with subprocess.Popen(
        [*OCCLUDER, "watch", *arguments], cwd=folder, text=True,
        env=environment(PYTHONUNBUFFERED="1", **variables),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as process:  # fmt: skip
        lines = []

        def read():
            for line in process.stdout:
                lines.append(line)  # noqa: PERF402

        reader = threading.Thread(target=read)
        reader.start()
        yield process, lines
        process.kill()
        reader.join()


def save(mesh, path):
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), path)


def hear(lines, words):
    until(lambda: any(words in line for line in lines), 120.0)
    lines.clear()


def test_it_builds_what_changes_until_ctrl_c(watching, tmp_path):
    process, lines = watching
    props = tmp_path / "props"
    hear(lines, "props/box.ply: built (it was never made): ")
    save(solids.torus(), tmp_path / "torus.ply")
    whole = (tmp_path / "torus.ply").read_bytes()
    (props / "torus.ply").write_bytes(whole[: len(whole) // 2])
    hear(lines, "error: props/torus.ply: failed: ")
    (props / "torus.ply").write_bytes(whole)
    hear(lines, "props/torus.ply: built (it was never made): ")
    shutil.move(props / "torus.ply", props / "ring.ply")
    hear(lines, "props/ring.ply: built (it was never made): ")
    with (tmp_path / "occluders.toml").open("a") as manifest:
        manifest.write("budgte = 3\n")
    hear(lines, "error: occluders.toml:10: 'budgte' is not known; did you mean 'budget'?")
    (tmp_path / "occluders.toml").write_text(MANIFEST + "budget = 8\n")
    hear(lines, "props/box.ply: built (budget was 64 and is 8): good, 8 triangles")
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    assert not any("Traceback" in line for line in lines)
    assert not list(tmp_path.rglob("*.tmp"))


@pytest.mark.slow
def test_a_service_that_wants_a_key_makes_what_changes(tmp_path):
    """Quietly, one asset at a time; ``occluder build`` takes the same key."""
    declared = os.pathsep.join([str(declare(tmp_path / "declared")), str(ROOT)])
    data, folder = tmp_path / "data", tmp_path / "folder"
    folder.mkdir()
    fill(folder)
    made = occluder(
        "keys", "create", "--scope", "write", OCCLUDER_DATA=str(data), PYTHONPATH=declared
    )
    key = made.stdout.strip()
    with running(declared, data, OCCLUDER_REQUIRE_KEYS="true") as server:
        asked = ("--server", server.address, "--at-once", "1")
        done = occluder("build", *asked, "--key", key[:-1], cwd=folder, PYTHONPATH=declared)
        assert done.returncode == 1
        assert "error: props/box.ply: failed: " in done.stderr
        with watch(folder, *asked, "--key", key, "--quiet", PYTHONPATH=declared) as (process, said):
            until((folder / "props/box_occluder.glb").is_file, 120.0)
            save(solids.torus(), folder / "props/torus.ply")
            until((folder / "props/torus_occluder.glb").is_file, 120.0)
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
        assert not [line for line in said if not line.startswith("warning: ")]
        done = occluder("build", *asked, "--key", key, cwd=folder, PYTHONPATH=declared)
        assert done.returncode == 0
        assert "2 assets: 2 current" in done.stdout
