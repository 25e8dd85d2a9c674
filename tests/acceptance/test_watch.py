"""``occluder watch`` as its users run it, from the first build to Ctrl-C."""

from __future__ import annotations

import shutil
import signal
import subprocess
import threading

import pytest

import simplifier
from tests import solids
from tests.acceptance.command import OCCLUDER, environment
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
    (tmp_path / "props").mkdir()
    (tmp_path / "occluders.toml").write_text(MANIFEST)
    save(solids.box(), tmp_path / "props/box.ply")
    with subprocess.Popen(
        [*OCCLUDER, "watch"], cwd=tmp_path, env=environment(PYTHONUNBUFFERED="1"), text=True,
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
