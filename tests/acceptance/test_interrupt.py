"""Ctrl-C in the real command, at any moment."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import time

import pytest

import simplifier
from tests.acceptance.command import OCCLUDER, environment, read_all, read_until
from tests.schema import check_report
from tests.solids import box, joined, sphere

ENDLESS = ("--resolution", "24", "--moves", "100000000", "--views", "4", "--image", "32")
LONG_REPORT = (
    "--resolution",
    "12",
    "--moves",
    "60",
    "--views",
    "256",
    "--image",
    "2048",
    "--exact",
)
KEPT, BEST = "its report is not", "warning: interrupted: this is the best"


@pytest.fixture
def interrupted(tmp_path):
    """``interrupted(words, after, *options)``: run, wait for words and seconds, press Ctrl-C.

    Returns the exit status, what the terminal showed, and the files by name; ``out.glb`` was there.
    """
    mesh = joined(box(), sphere())
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), tmp_path / "mesh.ply")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "out.glb").write_bytes(b"old")

    def run(words, after, *options):
        controller, terminal = pty.openpty()
        with subprocess.Popen(
            [
                *OCCLUDER, "simplify", tmp_path / "mesh.ply", "-o", folder / "out.glb",
                "--report", folder / "report.json", *options,
            ],
            stderr=terminal, stdout=subprocess.PIPE,
            env=environment(TERM="xterm-256color", COLUMNS="120"),
        ) as process:  # fmt: skip
            os.close(terminal)
            shown = read_until(controller, words)
            time.sleep(after)
            process.send_signal(signal.SIGINT)
            shown += read_all(controller)
            process.stdout.read()
        os.close(controller)
        assert b"Traceback" not in shown
        assert b"Exception ignored" not in shown
        files = {path.name: path.read_bytes() for path in folder.iterdir()}
        levels = {f"out_lod{index}.glb" for index in range(3)}
        assert set(files) <= {"out.glb", "report.json"} | levels  # no draft is left
        # A terminal breaks long lines, where paths are long.
        return process.returncode, " ".join(shown.decode().split()), files

    return run


def check_occluder(folder):
    assert 0 < len(simplifier.load(folder / "out" / "out.glb").faces) <= 64


def test_refining_keeps_the_best_so_far(interrupted, tmp_path):
    status, shown, files = interrupted(b"refining", 0.3, *ENDLESS)
    assert status == 0
    assert BEST in shown
    check_occluder(tmp_path)
    report = json.loads(files["report.json"])
    check_report(report)
    assert report["warnings"][0] == "interrupted: this is the best occluder so far"


@pytest.mark.slow
def test_levels_so_far_are_kept(interrupted, tmp_path):
    lods = ("--lods", "3", "--resolution", "24", "--moves", "16000", "--views", "4")
    status, _, files = interrupted(b"2/3 refining", 0.1, *lods)
    assert status == 0
    report = json.loads(files["report.json"])
    check_report(report)
    made = {row["file"] for row in report["levels"]}
    assert set(files) == {"out.glb", "report.json"} | made
    assert [one["resolution"] for one in report["left_out"]][-1] == 6
    assert "interrupted" in report["left_out"][-1]["reason"]
    check_occluder(tmp_path)


def test_measuring_keeps_the_occluder(interrupted, tmp_path):
    status, shown, files = interrupted(b"measuring", 0.1, *LONG_REPORT)
    assert status == 0
    assert KEPT in shown
    check_occluder(tmp_path)
    assert "report.json" not in files


def test_nothing_is_kept_before_there_is_something(interrupted):
    status, shown, files = interrupted(b"starting", 0.0, *ENDLESS)
    assert status == 130
    assert "error: interrupted; nothing was kept" in shown
    assert files == {"out.glb": b"old"}


@pytest.mark.sweep(3)
@pytest.mark.parametrize("after", [0.3, 0.8, 1.4])
def test_at_any_moment(interrupted, tmp_path, after):
    status, shown, files = interrupted(b"starting", after, "--image", "512", "--moves", "3000")
    if status == 130:
        assert "error: interrupted; nothing was kept" in shown
        assert files == {"out.glb": b"old"}
        return
    assert status == 0
    check_occluder(tmp_path)
    assert ("report.json" in files) != (KEPT in shown)
    if "report.json" in files:
        check_report(json.loads(files["report.json"]))


LOADING = """
import signal, sys
from simplifier.cli import main

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == "MODULE":
            INTERRUPT

sys.meta_path.insert(0, Interrupting())
sys.argv = ["occluder", "simplify", "mesh.ply", "-o", "out.glb"]
main.main()
"""


@pytest.mark.parametrize(
    ("module", "interrupt"),
    [
        ("numpy", "signal.raise_signal(signal.SIGINT)"),
        # As while a dataclass is made, which the interpreter keeps in mind until its end.
        ("simplifier.io.ply", "exec('signal.raise_signal(signal.SIGINT)')"),
    ],
)
def test_while_the_command_is_loaded(tmp_path, module, interrupt):
    simplifier.save(simplifier.Occluder(box().vertices, box().faces), tmp_path / "mesh.ply")
    code = LOADING.replace("MODULE", module).replace("INTERRUPT", interrupt)
    (tmp_path / "pressed.py").write_text(code)
    done = subprocess.run(
        [sys.executable, "-m", "pressed"], cwd=tmp_path,
        env=environment(), capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "error: interrupted; nothing was kept\n")
