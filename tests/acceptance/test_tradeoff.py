"""``occluder tradeoff`` through the real command line."""

from __future__ import annotations

import csv
import os
import pty
import signal
import subprocess
import time

import pytest

import simplifier
from simplifier.tradeoff.table import COLUMNS
from tests.acceptance.command import OCCLUDER, environment, occluder, read_all, read_until
from tests.io.builders import cubes
from tests.solids import box, joined

JOURNAL = "tradeoff.journal"
FILES = ["tradeoff.csv", "tradeoff.html", "tradeoff.json", "tradeoff.png"]
SMALL = ("--resolutions", "8", "--directions", "4", "--budgets", "8", "--times", "0.05")
HOSTILE = "a\n<script>$(id) é [bold].ply"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("meshes")
    mesh = joined(box(), box((0.5, 0.5, 0.5), (1.5, 0.0, 0.0)))
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), place / "boxes.ply")
    (place / HOSTILE).write_bytes((place / "boxes.ply").read_bytes())
    (place / "damaged.glb").write_bytes(b"glTF\2\0\0\0\xff\xff\0\0JSON")
    return place


def rows(out):
    with (out / "tradeoff.csv").open(newline="", encoding="utf-8") as file:
        found = list(csv.DictReader(file, strict=True))
    assert all(tuple(row) == COLUMNS for row in found)
    return found


def test_a_sweep_with_a_mesh_that_fails_and_a_hostile_name(folder, tmp_path):
    """The mesh keeps to the budget as it is: nothing is searched for, which takes seconds."""
    out = tmp_path / "deep" / "out"
    done = occluder(
        "tradeoff", folder / "damaged.glb", folder / HOSTILE, "-o", out, *SMALL, "--repeats", "1",
        "--precision", "0.9", "--budgets", "24",
    )  # fmt: skip
    assert done.returncode == 0
    assert sorted(path.name for path in out.iterdir()) == FILES
    failed, *measured = rows(out)
    assert (failed["mesh"], failed["standing"]) == ("damaged.glb", "failed")
    assert "damaged.glb" in failed["reason"]
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("warning: damaged.glb: ")
    names = ["draft", "balanced", "best", "resolution 8", "4 directions", "time 0.05 s"]
    assert [row["setting"] for row in measured] == names
    assert {row["mesh"] for row in measured} == {HOSTILE}
    assert {row["repeats"] for row in measured} == {"1"}
    front = {row["setting"] for row in measured if row["standing"] == "front"}
    assert front
    for row in measured:
        assert 0.0 < float(row["seconds_min"]) <= float(row["seconds"])
        assert float(row["seconds"]) <= float(row["seconds_max"])
        assert 0.0 <= float(row["overhang"]) < 0.5
        assert row["dominated_by"] in (front if row["standing"] == "dominated" else {""})
    assert "a <script>$(id) é [bold].ply, budget 24" in done.stdout
    assert "For more recall" in done.stdout
    assert "overhang" in done.stdout
    page = (out / "tradeoff.html").read_text("utf-8")
    assert "<script" not in page
    assert ">Overhang</th>" in page
    assert "&lt;script&gt;$(id)" in page
    assert (out / "tradeoff.png").read_bytes()[:4] == b"\x89PNG"


def test_every_combination_and_a_sweep_without_time_for_it(command, folder, tmp_path):
    mesh, several = folder / "boxes.ply", ("--resolutions", "8,10", "--directions", "4,6")
    asked = (*several, "--times", "0.05", "--budgets", "24", "--repeats", "1", "--full")
    status, _, errors = command("tradeoff", mesh, "-o", tmp_path, *asked)
    assert (status, errors) == (0, "")
    combined = [row["setting"] for row in rows(tmp_path) if "+" in row["setting"]]
    assert combined == [f"resolution {fine} + {bins} directions + time 0.05 s"
                        for fine in (8, 10) for bins in (4, 6)]  # fmt: skip
    status, _, errors = command("tradeoff", mesh, "-o", tmp_path, *asked, "--within", "1e-6")
    assert status == 0
    assert errors == (
        "warning: boxes.ply: there was no time for 11 of 12 settings; allow more than 0 ms\n"
    )
    assert [row["setting"] for row in rows(tmp_path)] == ["draft"]


@pytest.mark.parametrize(("asked", "triangles"), [((), "12"), (("--transparent", "keep"), "24")])
def test_what_is_see_through_counts_where_it_is_kept(command, tmp_path, asked, triangles):
    (tmp_path / "shop.glb").write_bytes(cubes({}, {"alphaMode": "BLEND"}))
    given = (*SMALL, "--budgets", "24", "--repeats", "1")
    status, _, _ = command("tradeoff", tmp_path / "shop.glb", "-o", tmp_path, *given, *asked)
    assert status == 0
    assert {row["triangles"] for row in rows(tmp_path)} == {triangles}


def test_a_memory_limit_is_kept_by_every_run(command, folder, tmp_path):
    asked = (*SMALL, "--repeats", "1", "--memory-limit", "0.001")
    status, _, errors = command("tradeoff", folder / "boxes.ply", "-o", tmp_path, *asked)
    assert status == 1
    assert "memory" in errors
    assert {row["standing"] for row in rows(tmp_path)} == {"failed"}
    assert all("memory" in row["reason"] for row in rows(tmp_path))


def test_all_fail(command, folder, tmp_path):
    meshes = (folder / "damaged.glb", tmp_path / "none.obj")
    status, output, errors = command("tradeoff", *meshes, "-o", tmp_path, *SMALL)
    assert (status, output) == (1, "")
    *warnings, error = errors.splitlines()
    assert [warning.partition(": ")[0] for warning in warnings] == ["warning"] * 2
    assert error.startswith("error: none of the meshes could be measured; tradeoff.csv in ")
    assert [row["standing"] for row in rows(tmp_path)] == ["failed"] * 2


@pytest.mark.slow
def test_ctrl_c_keeps_what_was_measured(folder, tmp_path):
    """The bar tells when the first run is over."""
    controller, terminal = pty.openpty()
    with subprocess.Popen(
        [
            *OCCLUDER, "tradeoff", folder / "boxes.ply", "-o", tmp_path, "--times", "0.05",
            "--budgets", "8", "--resolutions", "8", "--directions", "4",
        ],
        stderr=terminal, stdout=subprocess.DEVNULL,
        env=environment(TERM="xterm-256color", COLUMNS="120"),
    ) as process:  # fmt: skip
        os.close(terminal)
        shown = read_until(controller, b", best")
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        shown += read_all(controller)
    os.close(controller)
    assert process.returncode == 0
    assert b"2/18" in shown
    said = shown.decode().splitlines()[-1]
    assert "warning: interrupted after 2 of 18 runs; " in said
    assert f"{tmp_path} holds what they gave" in said
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*FILES, JOURNAL])
    assert [row["setting"] for row in rows(tmp_path)] == ["draft", "balanced"]


WRONG = {
    "no number": ("--resolutions", "32,fine"),
    "no values": ("--budgets", ""),
    "a fraction": ("--directions", "1.5"),
    "time 0": ("--times", "0"),
    "time NaN": ("--times", "nan"),
    "resolution": ("--resolutions", "1025"),
    "precision": ("--precision", "1.5"),
    "repeats": ("--repeats", "0"),
    "seed": ("--seed", "-1"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_usage(command, folder, tmp_path, name):
    status, output, errors = command(
        "tradeoff", folder / "boxes.ply", "-o", tmp_path / "out", *WRONG[name]
    )
    assert (status, output) == (2, "")
    assert errors.startswith("error: ")
    assert errors.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_no_folder_to_write_to(command, folder, tmp_path):
    (tmp_path / "file").write_text("")
    status, _, errors = command("tradeoff", folder / "boxes.ply", "-o", tmp_path / "file")
    assert status == 1
    assert "the folder cannot be made" in errors


@pytest.mark.slow
def test_overrides_beside_a_mesh_hold_for_every_run(here, tmp_path):
    """A budget that the drawn box uses up, and that else would do for the mesh itself."""
    mesh = box()
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), tmp_path / "box.ply")
    by_hand = tmp_path / "box.overrides.toml"
    by_hand.write_text("[[box]]\ncenter = [0.5, 0.5, 0.5]\nsize = [0.5, 0.5, 0.5]\n")
    arguments = ("tradeoff", tmp_path / "box.ply", "-o", tmp_path, *SMALL, "--repeats", "1",
                 "--budgets", "12")  # fmt: skip
    assert here(*arguments).returncode == 0
    assert all(float(row["recall"]) < 0.5 for row in rows(tmp_path))
    assert here(*arguments, "--no-overrides").returncode == 0
    assert all(float(row["recall"]) == 1.0 for row in rows(tmp_path))
    by_hand.write_text("[[boxes]]\n")
    assert here(*arguments).returncode == 1
    assert "box.overrides.toml:1: there is no key 'boxes'" in rows(tmp_path)[0]["reason"]
