"""The real command: every format, its reports, its exit statuses, its manners."""

from __future__ import annotations

import json
import os
import pty
import shlex
import subprocess
import sys
from typing import get_args

import pytest

import simplifier
from simplifier import api
from simplifier.cli.main import OWN
from simplifier.device.choice import close_device, open_device
from simplifier.io.formats import writable_suffixes
from simplifier.options.fields import OptionGroup
from tests.acceptance.command import (
    OCCLUDER,
    beside_verdict,
    environment,
    occluder,
    read_all,
)
from tests.schema import check_report
from tests.solids import as_occluder, blob, box, joined, torus

QUICK = ("--resolution", "12", "--preset", "draft", "--moves", "100")
FEW_VIEWS = ("--views", "4", "--image", "32", "--quads", "50")

OPEN_BOX = """# made elsewhere: quads, texture indices, negative indices, a group
g walls
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
vt 0 0
f 1/1 2/1 3/1 4/1
f 5 6 7 8
f -5 -6 -2 -1
f 2 3 7 6
f 4 1 5 8
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two meshes: a closed box with a smaller one beside it, and an open box."""
    place = tmp_path_factory.mktemp("meshes")
    mesh = joined(box(), box((0.5, 0.5, 0.5), (1.5, 0.0, 0.0)))
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), place / "boxes.ply")
    (place / "open.obj").write_text(OPEN_BOX)
    return place


def one_line(text):
    """The line that a failure writes."""
    assert text.startswith("error: ")
    assert text.count("\n") == 1
    assert text.endswith("\n")
    assert "Traceback" not in text
    return text


# In a process of its own: formats, reports, pictures.


@pytest.mark.parametrize("suffix", [".glb", ".tres"])
def test_simplify_writes_an_occluder_and_a_table(folder, tmp_path, suffix, here):
    done = here(
        "simplify", folder / "boxes.ply", "-o", tmp_path / f"out{suffix}", "--budget", "20",
        *QUICK, *FEW_VIEWS, "--conservative", "--moves", "2000",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "24 -> " in done.stdout
    assert "recall" in done.stdout
    assert 0 < len(simplifier.load(tmp_path / f"out{suffix}").faces) <= 20
    assert [path.name for path in tmp_path.iterdir()] == [f"out{suffix}"]


def test_a_report_that_is_called_a_page_is_refused_before_the_work(here, folder, tmp_path):
    """It was JSON, which a browser shows as a wall of text."""
    made, report = tmp_path / "out.obj", tmp_path / "fence.html"
    done = here("simplify", folder / "boxes.ply", "-o", made, "--report", report, *QUICK)
    assert done.returncode == 2
    assert "--report fence.json" in one_line(done.stderr)
    assert "--pictures" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_report_and_pictures(here, folder, tmp_path):
    done = here(
        "simplify", folder / "boxes.ply", "-o", tmp_path / "out.obj", "--min-precision", "0.9",
        "--report",
        tmp_path / "report.json", "--pictures", tmp_path / "pictures", "--seed", "4", *QUICK,
        *FEW_VIEWS, "--budget", "11",
    )  # fmt: skip
    assert (done.returncode, beside_verdict(done.stderr)) == (0, "")
    report = json.loads((tmp_path / "report.json").read_text(), parse_constant=pytest.fail)
    check_report(report)
    assert report["triangles"] == len(simplifier.load(tmp_path / "out.obj").faces)
    assert report["input"]["triangles"] == 24
    assert report["options"]["resolution"] == 12
    assert report["options"]["accuracy"]["views"] == len(report["by_view"]) == 4
    assert report["seed"] == report["options"]["accuracy"]["seed"] == 4
    assert report["deviation"] <= report["error_bound"]
    ran = {stage for stage, seconds in report["timings"].items() if seconds > 0.0}
    assert ran >= {"load", "voxelize", "fill", "sections", "cut", "refine", "accuracy", "write"}
    pictures = {path.name: path.read_bytes() for path in (tmp_path / "pictures").iterdir()}
    assert {"report.html", "silhouettes.png", "recall.png", "precision.png"} <= set(pictures)
    assert sum(name.startswith("view_") for name in pictures) == 4
    assert all(data[:4] == b"\x89PNG" for name, data in pictures.items() if name[-4:] == ".png")
    assert b"boxes.ply" in pictures["report.html"]


def test_a_result_that_is_not_good_is_never_silent(command, folder, tmp_path):
    """A shell has no inside in a flood fill, so that keeping some length inside recalls nothing."""
    made, report = tmp_path / "out.obj", tmp_path / "report.json"
    run = ("simplify", folder / "open.obj", "-o", made, "--fill", "flood", "--report", report)
    status, shown, errors = command(*run, "--shrink", "0.01", *QUICK, *FEW_VIEWS)
    assert status == 0
    assert "unusable" in shown
    assert "warning: unusable: it has no triangles, so it hides nothing\n" in errors
    told = json.loads(report.read_text())["verdict"]
    assert f"try: {told['next']}\n" in errors
    status, _, errors = command(*run, "--shrink", "0.01", *QUICK, *FEW_VIEWS, "--strict")
    assert status == 1
    assert errors.endswith("error: open.obj: the occluder is not good\n")
    assert made.exists()
    status, shown, errors = command(*shlex.split(told["next"])[1:], "--strict")
    assert status == 0
    assert "try: " not in errors
    assert "\ngood: it hides " in shown
    made.write_text("v .1 .1 .5\nv .2 .1 .5\nv .2 .2 .5\nf 1 2 3\n")
    status, _, errors = command("evaluate", folder / "boxes.ply", made, *FEW_VIEWS, "--strict")
    assert status == 1
    assert "try: occluder simplify " in errors


def test_evaluate_an_obj_made_elsewhere(folder, tmp_path, here):
    (tmp_path / "hand_made.obj").write_text("v .1 .1 .5\nv .9 .1 .5\nv .9 .9 .5\nf 1 2 3\n")
    done = here(
        "evaluate", folder / "open.obj", tmp_path / "hand_made.obj", "--ground", "--exact",
        "--resolution", "16", "--report", tmp_path / "report.json",
    )  # fmt: skip
    assert (done.returncode, beside_verdict(done.stderr)) == (0, "")
    assert "no promise" in done.stdout
    report = json.loads((tmp_path / "report.json").read_text())
    check_report(report)
    assert report["error_bound"] is None
    assert report["triangles"] == 1
    assert report["precision"] > 0.9
    assert 0.0 < report["recall"] < 0.5
    assert report["options"]["accuracy"] == {
        "views": 256, "image": 256, "quads": 32000, "seed": 0, "exact": True, "viewers": "all",
        "up": "y",
    }  # fmt: skip


# In this process, through the same entry point: quick enough for many cases.


@pytest.mark.parametrize("suffix", writable_suffixes())
def test_every_output_format_can_be_judged(command, folder, tmp_path, suffix):
    target = tmp_path / f"out{suffix}"
    report = tmp_path / "report.json"
    status, _, errors = command(
        "simplify", folder / "boxes.ply", "-o", target, "--report", report, *QUICK, *FEW_VIEWS
    )
    assert (status, errors) == (0, "")
    made = json.loads(report.read_text())
    status, _, errors = command(
        "evaluate", folder / "boxes.ply", target, "--report", report, "--resolution", "12",
        *FEW_VIEWS,
    )  # fmt: skip
    assert (status, errors) == (0, "")
    judged = json.loads(report.read_text())
    check_report(judged)
    assert judged["triangles"] == made["triangles"]
    assert judged["recall"] == pytest.approx(made["recall"], abs=0.02)
    # Only GLB and OCC have a place for the promise, in float64.
    expected = pytest.approx(made["error_bound"]) if suffix in (".glb", ".occ") else None
    assert judged["error_bound"] == expected


@pytest.mark.parametrize(
    "option",
    [
        ("--trim", "area"),
        ("--preset", "best"),
        ("--alpha", "0.1"),
        ("--exact",),
        ("--error-bound", "0.5"),
        ("--error-share", "0.2"),
        ("--ground", "--up", "z"),
        ("--time-limit", "0.05"),
        ("--min-precision", "0.999"),
        ("--viewers", "above"),
        ("--viewers", "inside", "--eye-height", "0.3"),
        ("--smallest-hole", "0.2"),
        ("--conservative",),
        ("--conservative", "--slicer", "gl"),
        ("--shrink", "0.01"),
    ],
)
def test_options_are_understood(command, folder, tmp_path, option):
    size = () if option[0] == "--error-bound" else ("--resolution", "10")
    moves = () if option[0] == "--time-limit" else ("--moves", "50")
    status, _, errors = command(
        "simplify", folder / "boxes.ply", "-o", tmp_path / "o.glb", *size, *moves,
        *FEW_VIEWS, *option, "--report", tmp_path / "r.json",
    )  # fmt: skip
    assert (status, beside_verdict(errors)) == (0, "")
    report = json.loads((tmp_path / "r.json").read_text())
    check_report(report)
    assert report["options"]["time_limit"] == (None if moves else 0.05)


def test_warnings_go_to_standard_error(command, folder, tmp_path):
    status, output, errors = command(
        "simplify", folder / "open.obj", "-o", tmp_path / "o.glb", "--resolution", "24",
        "--preset", "draft", "--fill", "flood", *FEW_VIEWS,
    )  # fmt: skip
    assert status == 0
    assert errors.startswith("warning: the mesh is not watertight at 24 voxels")
    assert "ground with up y (closes 81 % of the grid)" in errors
    assert errors.count("\n") == 1
    assert "warning:" not in output


BOXES, OUT = "{folder}/boxes.ply", "{tmp}/out.glb"

WRONG_USAGE = {
    "no output": ("simplify", BOXES),
    "no mesh": ("simplify",),
    "unknown option": ("simplify", BOXES, "-o", OUT, "--speed", "9"),
    "unknown command": ("simplifi", BOXES),
    "unknown choice": ("simplify", BOXES, "-o", OUT, "--trim", "luck"),
    "unknown axis": ("simplify", BOXES, "-o", OUT, "--up", "w"),
    "unknown preset": ("simplify", BOXES, "-o", OUT, "--preset", "turbo"),
    "no number": ("simplify", BOXES, "-o", OUT, "--budget", "many"),
    "a fraction": ("simplify", BOXES, "-o", OUT, "--budget", "1.5"),
    "budget 0": ("simplify", BOXES, "-o", OUT, "--budget", "0"),
    "budget below 0": ("simplify", BOXES, "-o", OUT, "--budget", "-3"),
    "budget too large": ("simplify", BOXES, "-o", OUT, "--budget", "100001"),
    "budget of 400 digits": ("simplify", BOXES, "-o", OUT, "--budget", "9" * 400),
    "resolution 0": ("simplify", BOXES, "-o", OUT, "--resolution", "0"),
    "resolution too large": ("simplify", BOXES, "-o", OUT, "--resolution", "1025"),
    "resolution and bound": (
        "simplify", BOXES, "-o", OUT, "--resolution", "9", "--error-bound", "0.01",
    ),
    "bound 0": ("simplify", BOXES, "-o", OUT, "--error-bound", "0"),
    "bound NaN": ("simplify", BOXES, "-o", OUT, "--error-bound", "nan"),
    "bound too fine": ("simplify", BOXES, "-o", OUT, "--error-bound", "1e-9"),
    "hole below 0": ("simplify", BOXES, "-o", OUT, "--smallest-hole", "-1"),
    "hole NaN": ("simplify", BOXES, "-o", OUT, "--smallest-hole", "nan"),
    "hole too large": ("simplify", BOXES, "-o", OUT, "--smallest-hole", "2.1"),
    "hole to judge by": ("evaluate", BOXES, BOXES, "--smallest-hole", "inf"),
    "shrink below 0": ("simplify", BOXES, "-o", OUT, "--shrink", "-0.1"),
    "shrink in words": ("simplify", BOXES, "-o", OUT, "--shrink", "little"),
    "unknown viewers": ("simplify", BOXES, "-o", OUT, "--viewers", "below"),
    "alpha": ("simplify", BOXES, "-o", OUT, "--alpha", "2"),
    "precision above 1": ("simplify", BOXES, "-o", OUT, "--min-precision", "1.01"),
    "precision NaN": ("simplify", BOXES, "-o", OUT, "--min-precision", "nan"),
    "moves": ("simplify", BOXES, "-o", OUT, "--moves", "-1"),
    "time limit 0": ("simplify", BOXES, "-o", OUT, "--time-limit", "0"),
    "time limit NaN": ("simplify", BOXES, "-o", OUT, "--time-limit", "nan"),
    "moves and time limit": (
        "simplify", BOXES, "-o", OUT, "--time-limit", "1", "--moves", "9",
    ),
    "seed": ("simplify", BOXES, "-o", OUT, "--seed", "-1"),
    "views": ("evaluate", BOXES, BOXES, "--views", "0"),
    "image": ("evaluate", BOXES, BOXES, "--image", "7"),
    "quads": ("evaluate", BOXES, BOXES, "--quads", "0"),
    "no occluder": ("evaluate", BOXES),
}  # fmt: skip


def filled(arguments, folder, tmp_path):
    return [
        word.replace("{folder}", str(folder)).replace("{tmp}", str(tmp_path)) for word in arguments
    ]


@pytest.mark.parametrize("name", WRONG_USAGE)
def test_wrong_usage(command, folder, tmp_path, name):
    status, output, errors = command(*filled(WRONG_USAGE[name], folder, tmp_path))
    assert (status, output) == (2, "")
    assert "; " in one_line(errors)
    assert list(tmp_path.iterdir()) == []


FAILURES = {
    "missing mesh": (("simplify", "{tmp}/none.obj", "-o", OUT), "none.obj"),
    "unknown format": (("simplify", "{tmp}/mesh.xyz", "-o", OUT), "use one of"),
    "no suffix": (("simplify", "{tmp}/mesh", "-o", OUT), "no suffix"),
    "a folder without a suffix": (("simplify", "{tmp}", "-o", OUT), "this is a folder"),
    "the root": (("simplify", "/", "-o", OUT), "this is a folder"),
    "an empty name": (("evaluate", "", BOXES), "this is a folder"),
    "a device": (("simplify", BOXES, "-o", "/dev/null"), "this is not a folder"),
    "a report to a device": (
        ("simplify", BOXES, "-o", OUT, "--report", "/dev/null"), "a folder or a device",
    ),
    "too long a name": (("simplify", BOXES, "-o", "{tmp}/" + 300 * "n" + ".glb"), "a shorter one"),
    "damaged": (("simplify", "{tmp}/damaged.glb", "-o", OUT), "damaged.glb"),
    "something else": (("simplify", "{tmp}/really.obj", "-o", OUT), "the suffix says"),
    "no triangles": (("simplify", "{tmp}/points.obj", "-o", OUT), "no triangle"),
    "a folder": (("simplify", "{tmp}/folder.obj", "-o", OUT), "folder.obj"),
    "missing output folder": (("simplify", BOXES, "-o", "{tmp}/no/o.glb"), "create it first"),
    "unknown output": (("simplify", BOXES, "-o", "{tmp}/o.fbx"), "cannot be written"),
    "missing report folder": (
        ("simplify", BOXES, "-o", OUT, "--report", "{tmp}/no/r.json"), "create it first",
    ),
    "pictures into a file": (
        ("simplify", BOXES, "-o", OUT, "--pictures", "{tmp}/points.obj"), "this is not a folder",
    ),
    "pictures in place of the occluder": (
        ("simplify", BOXES, "-o", OUT, "--pictures", OUT), "this is the occluder",
    ),
    "missing occluder": (("evaluate", BOXES, "{tmp}/none.glb"), "none.glb"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAILURES)
def test_failures(command, folder, tmp_path, name):
    (tmp_path / "damaged.glb").write_bytes(b"glTF\2\0\0\0\xff\xff\0\0JSON")
    (tmp_path / "really.obj").write_bytes(b"\x89PNG\r\n\x1a\n0000")
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    (tmp_path / "folder.obj").mkdir()
    before = sorted(tmp_path.iterdir())
    arguments, words = FAILURES[name]
    status, output, errors = command(*filled(arguments, folder, tmp_path))
    assert (status, output) == (1, "")
    assert words in one_line(errors)
    assert sorted(tmp_path.iterdir()) == before


def test_debug_adds_the_traceback(command, tmp_path):
    arguments = ("simplify", tmp_path / "none.obj", "-o", tmp_path / "o.glb")
    plain = command(*arguments)
    debugged = command(*arguments, "--debug")
    assert plain[0] == debugged[0] == 1
    assert debugged[2].startswith("Traceback (most recent call last):")
    assert debugged[2].endswith(plain[2])


def test_bugs_are_one_line_too(command, folder, tmp_path, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("a bug\nin two lines")

    monkeypatch.setattr(api, "simplify_mesh", broken)
    arguments = ("simplify", folder / "boxes.ply", "-o", tmp_path / "o.glb")
    status, _, errors = command(*arguments)
    assert status == 1
    assert "unexpected ZeroDivisionError: a bug in two lines; run it again" in one_line(errors)
    assert "Traceback" in command(*arguments, "--debug")[2]


def test_too_little_memory(command, folder, tmp_path, monkeypatch):
    def greedy(*_):
        raise MemoryError

    monkeypatch.setattr(api, "simplify_mesh", greedy)
    status, _, errors = command("simplify", folder / "boxes.ply", "-o", tmp_path / "o.glb")
    assert status == 1
    assert "choose a lower --resolution" in one_line(errors)


def test_without_opengl(command, folder, tmp_path, monkeypatch):
    glcontext = pytest.importorskip("glcontext")

    def broken(name):
        raise RuntimeError("no EGL here")

    monkeypatch.setattr(glcontext, "get_backend_by_name", broken)
    status, _, errors = command(
        "simplify",
        folder / "boxes.ply",
        "-o",
        tmp_path / "o.glb",
        "--slicer",
        "gl",
        "--budget",
        "11",
    )
    assert status == 1
    assert "or use the cpu slicer" in one_line(errors)


def test_a_device_is_named_and_changes_no_byte(command, folder, tmp_path):
    """By what OpenGL there is; where there is none a line says so, and the processor works."""
    made, reports = {}, {}
    for device in ("cpu", "gpu"):
        out, report = tmp_path / f"{device}.glb", tmp_path / f"{device}.json"
        status, _, errors = command(
            "simplify", folder / "boxes.ply", "-o", out, "--budget", "20", "--report", report,
            "--device", device, "--slicer", "cpu", *QUICK, *FEW_VIEWS,
        )  # fmt: skip
        assert status == 0
        assert ("device gpu: " in errors) == bool(open_device(device).remarks)
        made[device], reports[device] = out.read_bytes(), json.loads(report.read_text())
        check_report(reports[device])
    assert made["gpu"] == made["cpu"]
    assert reports["cpu"]["device"] == "cpu"
    assert reports["gpu"]["device"] == open_device("gpu").name
    for key in ("precision", "recall", "by_view", "overhang", "front", "occlusion_measure"):
        assert reports["gpu"][key] == reports["cpu"][key]


def test_a_graphics_card_that_is_not_there(command, folder, tmp_path, monkeypatch):
    close_device()
    monkeypatch.setitem(sys.modules, "moderngl", None)
    out = tmp_path / "out.glb"
    asked = ("--device", "gpu", "--budget", "20", *QUICK)
    assert command("simplify", folder / "boxes.ply", "-o", out, *asked, *FEW_VIEWS)[0] == 0
    status, _, errors = command(
        "evaluate", folder / "boxes.ply", out, "--device", "gpu", *FEW_VIEWS
    )
    close_device()
    assert status == 0
    (line,) = [one for one in errors.splitlines() if "device gpu" in one]
    assert "the processor did all the work: device gpu: the Python package moderngl is" in line
    assert "or use --device cpu" in line


def test_version_and_help(command):
    status, output, errors = command("--version")
    assert (status, output, errors) == (0, f"{simplifier.__version__}\n", "")
    status, output, errors = command("--help")
    assert (status, errors) == (0, "")
    words = " ".join(output.split())
    for own in OWN.values():  # whole, however narrow the terminal is
        assert own.help in words
    for name in ("simplify", "evaluate", "tradeoff", "warmup"):
        assert name in output
        status, help_text, errors = command(name, "--help")
        assert (status, errors) == (0, "")
        assert "--debug" in help_text
    status, output, _ = command()
    assert status == 2
    assert "simplify" in output


@pytest.mark.parametrize(
    "name",
    ["simplify", "evaluate", "tradeoff", "path", "scene", "cull", "pvs", "build"],
)
def test_the_short_help_is_the_help_and_has_examples(command, name):
    shown = command(name, "-h")
    assert shown == command(name, "--help")
    status, output, errors = shown
    assert (status, errors) == (0, "")
    heads = [line.split()[1:-1] for line in output.splitlines() if line.startswith("╭")]
    titles = [" ".join(word for word in head if word.strip("─")) for head in heads]
    order = ["Arguments", *get_args(OptionGroup)]
    assert titles == sorted(titles, key=order.index)
    assert "Output" in titles
    examples = output.partition("Examples:")[2]
    assert 2 <= examples.count(f" occluder {name} ") + examples.count(f" occluder {name}\n") <= 3


def test_a_shell_completes_commands_and_options():
    done = occluder(_OCCLUDER_COMPLETE="complete_bash", COMP_WORDS="occluder sim", COMP_CWORD="1")
    assert (done.returncode, done.stdout.split()) == (0, ["simplify"])
    done = occluder(
        _OCCLUDER_COMPLETE="complete_bash", COMP_WORDS="occluder simplify --res", COMP_CWORD="2"
    )
    assert (done.returncode, done.stdout.split()) == (0, ["--resolution"])


# What is printed.


def test_what_is_current_is_said_to_be_and_not_made(command, folder, tmp_path, monkeypatch):
    mesh, out, report = tmp_path / "mesh.obj", tmp_path / "out.glb", tmp_path / "report.json"
    mesh.write_text(OPEN_BOX)
    run = ("simplify", mesh, "-o", out, *QUICK, *FEW_VIEWS)
    first = command(*run, "--report", report)
    assert f"made: {out}, " in first[1]
    before = out.read_bytes(), report.read_bytes(), out.stat().st_mtime_ns
    again = command(*run, "--report", report)
    assert again[0] == 0
    assert f"current: {out}, " in again[1]
    assert again[2] == first[2]
    assert before == (out.read_bytes(), report.read_bytes(), out.stat().st_mtime_ns)

    def made(*changes):
        status, output, _ = command(*run, *changes)
        assert status == 0
        return f"made: {out}, " in output

    assert made("--force")
    assert made("--seed", "1")
    assert not made("--seed", "1")
    assert made("--pictures", tmp_path / "pictures")  # which are not kept
    assert not made()
    by_hand = '[[open]]\nname = "door"\ncenter = [0.5, 0.5, 0]\nsize = [0.2, 0.2, 0.2]\n'
    (tmp_path / "mesh.overrides.toml").write_text(by_hand)
    assert made("--no-overrides")
    assert made()
    out.write_bytes(b"something else")
    assert made()
    mesh.write_text(OPEN_BOX.replace("v 1 1 1", "v 1 1 2"))
    assert made()
    # Where nothing can be kept, nothing is known to be current.
    monkeypatch.setenv("XDG_CONFIG_HOME", str(mesh))
    assert made()
    assert made()


def test_standard_output_is_the_report_or_nothing(command, folder, tmp_path):
    mesh, out = folder / "boxes.ply", tmp_path / "out.glb"
    run = ("simplify", mesh, "-o", out, *QUICK, *FEW_VIEWS, "--report", tmp_path / "report.json")
    status, output, _ = command(*run, "--json")
    assert status == 0
    assert json.loads(output) == json.loads((tmp_path / "report.json").read_text())
    status, output, _ = command(*run, "--quiet")
    assert (status, output) == (0, "")
    status, output, _ = command("evaluate", mesh, out, *FEW_VIEWS, "--json")
    assert (status, json.loads(output)["triangles"]) == (0, len(simplifier.load(out).faces))
    assert "time: load" not in command("evaluate", mesh, out, *FEW_VIEWS)[1]
    assert "time: load" in command("evaluate", mesh, out, *FEW_VIEWS, "--verbose")[1]


def test_the_next_command_runs(command, folder, tmp_path):
    out = tmp_path / "out.glb"
    run = ("simplify", folder / "boxes.ply", "-o", out, *FEW_VIEWS, "--min-precision", "0.9")
    status, output, errors = command(*run, "--moves", "3000", "--budget", "24")
    assert (status, errors) == (0, "")
    made, good, then = output.splitlines()[-3:]
    assert made.startswith(f"made: {out}, ")
    assert made.endswith(" in place of 24")
    assert good.startswith("good: it hides ")
    words = shlex.split(then.removeprefix("next: "))
    assert command(*words[1:])[0] == 0
    assert (tmp_path / "out_pictures" / "report.html").is_file()


def test_every_option_of_simplify_is_in_its_help(command):
    output = command("simplify", "--help")[1]
    for name in (
        "budget",
        "error-bound",
        "resolution",
        "ground",
        "preset",
        "pictures",
        "seed",
        "viewers",
        "smallest-hole",
        "conservative",
        "shrink",
    ):
        assert f"--{name}" in output


# The scene's own facts.

SCENE = ("--resolution", "32", "--preset", "draft", "--budget", "16", "--image", "64", "--exact")


def write_mesh(mesh, path):
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), path)
    return path


def reported(command, *arguments):
    status, _, errors = command(*arguments)
    assert status == 0
    report = json.loads(arguments[-1].read_text())
    check_report(report)
    assert list(map(str.strip, beside_verdict(errors).splitlines())) == [
        f"warning: {words}" for words in report["warnings"]
    ]
    return report


def test_viewers_above(command, tmp_path):
    mesh, out = write_mesh(box(without=[2]), tmp_path / "lid.ply"), tmp_path / "out.glb"
    more = (*SCENE, "--viewers", "above", "--views", "48", "--report", tmp_path / "report.json")
    made = reported(command, "simplify", mesh, "-o", out, *more)
    assert [closing["by"] for closing in made["solid"]["closed_by"]] == ["ground"]
    assert all(view["direction"][1] <= 0.0 for view in made["by_view"])
    assert made["options"]["viewers"] == made["options"]["accuracy"]["viewers"] == "above"
    assert made["options"]["ground"] is True
    assert made["warnings"] == []
    judged = reported(
        command, "evaluate", mesh, out, "--resolution", "32", *SCENE[6:], *more[len(SCENE) :]
    )
    assert judged["by_view"] == made["by_view"]
    assert judged["solid"] == made["solid"]
    assert judged["deviation"] == pytest.approx(made["deviation"], abs=1e-6)


def test_less_in_front(command, tmp_path):
    """Sixteen triangles would close the hole of a torus in plain sight of who looks along it."""
    simplifier.save(as_occluder(torus()), tmp_path / "torus.ply")
    shares = []
    for front in ("1", "0.01"):
        status, *_ = command(
            "simplify", tmp_path / "torus.ply", "-o", tmp_path / "o.glb", "--preset", "draft",
            "--budget", "16", "--resolution", "24", "--moves", "3000", "--overhang", "0.05",
            "--front", front, "--report", tmp_path / "r.json",
        )  # fmt: skip
        assert status in (0, 3)
        report = json.loads((tmp_path / "r.json").read_text())
        assert report["options"]["refine"]["front"] == float(front)
        shares.append(report["front"]["share"])
    assert shares[1] < 0.7 * shares[0]


def test_a_smallest_hole(command, tmp_path):
    flaps = [box((0.4, 0, 1), (x, 1, 0), without=[0, 1, 2, 4, 5]) for x in (0, 0.6)]
    mesh = write_mesh(joined(box(without=[3]), *flaps), tmp_path / "gap.ply")
    words = ("simplify", mesh, "-o", tmp_path / "out.glb", *SCENE, "--views", "16",
             "--fill", "flood")  # fmt: skip
    report = ("--report", tmp_path / "report.json")
    (warning,) = reported(command, *words, *report)["warnings"]
    advised = warning.split("smallest hole ")[1].split(" (closes")[0]
    closed = reported(command, *words, "--smallest-hole", advised, *report)
    assert closed["warnings"] == []
    (closing,) = closed["solid"]["closed_by"]
    assert closing["by"] == "smallest_hole"
    assert closing["volume"] == pytest.approx((30 / 32) ** 3, rel=0.1)
    assert closed["options"]["smallest_hole"] == float(advised)
    assert closed["recall"] > 0.7
    judged = reported(
        command, "evaluate", mesh, tmp_path / "out.glb", "--resolution", "32", "--views", "4",
        "--image", "32", "--smallest-hole", advised, *report,
    )  # fmt: skip
    assert judged["solid"] == closed["solid"]


def test_conservative(command, tmp_path):
    mesh = write_mesh(blob(), tmp_path / "blob.ply")
    report = reported(
        command, "simplify", mesh, "-o", tmp_path / "out.glb", *SCENE, "--views", "512",
        "--conservative", "--report", tmp_path / "report.json",
    )  # fmt: skip
    assert report["precision"] == 1.0
    assert all(view["precision"] == 1.0 for view in report["by_view"])
    assert report["error_bound"] == report["deviation"] == 0.0
    assert report["recall"] > 0.1
    assert report["options"]["conservative"] is True


def test_shrink_to_nothing(command, tmp_path):
    mesh, out = write_mesh(blob(), tmp_path / "blob.ply"), tmp_path / "out.obj"
    words = ("simplify", mesh, "-o", out, *SCENE, "--views", "4", "--shrink")
    report = ("--report", tmp_path / "report.json")
    shrunk = reported(command, *words, "0.2", *report)
    assert shrunk["triangles"] > 0
    assert shrunk["options"]["conservative"] is True
    nothing = reported(command, *words, "3", *report)
    assert nothing["triangles"] == 0
    assert (nothing["precision"], nothing["recall"]) == (1.0, 0.0)
    assert "no voxel is as deep inside as shrink 3" in nothing["warnings"][0]
    assert out.exists()


# Names.

HOSTILE = b"two\nlines\x1b[31m\x07 \xff\xfe.obj"

NAMES = [
    "schloß 城 Ωmega.obj",
    "-o.obj",
    "[bold]red $(id) ; & 'x' \".obj",
    "rtl \u202etab.obj",
    os.fsdecode(HOSTILE),
]
DRAWN = NAMES[2], NAMES[4]
"""Which also go into pictures and a page, those with letters that mean something there."""


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_any_file_name(command, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    source, target = tmp_path / name, tmp_path / f"out {name}"
    source.write_text(OPEN_BOX)
    status, output, errors = command(
        "simplify", "-o", target.name, "--ground", "--report", "report.json",
        *(("--pictures", "p") if name in DRAWN else ()), *QUICK, *FEW_VIEWS, "--", name,
    )  # fmt: skip
    assert (status, errors) == (0, "")
    assert output.splitlines()[0].isprintable()
    assert len(simplifier.load(target).faces) > 0
    check_report(json.loads((tmp_path / "report.json").read_text()))
    status, _, errors = command("simplify", "-o", target.name, "--", f"no {name}")
    assert status == 1
    assert one_line(errors)[:-1].isprintable()


def test_a_hostile_name_in_a_process_of_its_own(tmp_path):
    source = tmp_path / os.fsdecode(HOSTILE)
    source.write_text(OPEN_BOX)
    done = occluder(
        "simplify", source.name, "-o", "o.obj", "--ground", *QUICK, *FEW_VIEWS, cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "two lines\\x1b[31m\\x07 \\udcff\\udcfe.obj" in done.stdout


def test_a_locale_without_the_letters(folder, tmp_path):
    source = tmp_path / "schloß.obj"
    source.write_text(OPEN_BOX)
    done = occluder(
        "simplify", source, "-o", tmp_path / "o.obj", "--ground", *QUICK, *FEW_VIEWS,
        PYTHONIOENCODING="ascii",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "schlo" in done.stdout


# Terminals, pipes, signals.


def test_a_bar_on_a_terminal(folder, tmp_path):
    controller, terminal = pty.openpty()
    with subprocess.Popen(
        [*OCCLUDER, "simplify", folder / "boxes.ply", "-o", tmp_path / "o.glb", "--moves", "15000",
         "--budget", "11", *FEW_VIEWS],
        stderr=terminal, stdout=subprocess.PIPE,
        env=environment(TERM="xterm-256color", COLUMNS="100", NO_COLOR=None),
    ) as process:  # fmt: skip
        os.close(terminal)
        shown = read_all(controller)
        output = process.stdout.read()
    os.close(controller)
    assert process.returncode == 0
    assert b"refining" in shown
    assert b"\x1b[2K" in shown  # and wiped away
    assert b"\x1b" not in output
    assert b"recall" in output


@pytest.mark.parametrize("arguments", [("--help",), ("evaluate", "{0}", "{0}", *FEW_VIEWS)])
def test_nobody_reads(folder, arguments):
    mesh = str(folder / "boxes.ply")
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "wb") as closed:
        done = subprocess.run(
            [*OCCLUDER, *(word.format(mesh) for word in arguments)],
            stdout=closed, stderr=subprocess.PIPE, env=environment(), timeout=60, check=False,
        )  # fmt: skip
    assert b"Traceback" not in done.stderr
    assert b"BrokenPipeError" not in done.stderr
    assert done.returncode in (0, 1)


def test_the_mesh_is_not_overwritten_by_its_occluder(here, tmp_path):
    mesh = tmp_path / "castle.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    before = mesh.read_bytes()
    done = here("simplify", mesh, "-o", mesh)
    assert done.returncode == 1
    assert "this is the mesh itself" in done.stderr
    assert mesh.read_bytes() == before


IN_PLACE = {
    "a report, of the mesh": ("simplify", "a.obj", "-o", "o.glb", "--report", "a.obj"),
    "by a link": ("simplify", "a.obj", "-o", "o.glb", "--report", "link.json"),
    "of the overrides": ("simplify", "a.obj", "-o", "o.glb", "--report", "a.overrides.toml"),
    "of the occluder": ("simplify", "a.obj", "-o", "b.ply", "--report", "b.ply"),
    "of a level": ("simplify", "a.obj", "-o", "b.ply", "--lods", "2", "--report", "b_lod1.ply"),
    "of the mesh that is judged": ("evaluate", "a.obj", "b.ply", "--report", "a.obj"),
    "of the occluder that is judged": ("evaluate", "a.obj", "b.ply", "--report", "b.ply"),
    "what is packed, of the scene": ("scene", "a.obj", "-o", "tree", "--packed", "a.obj"),
    "a report, of the scene": ("pvs", "a.obj", "-o", "a.pvs", "--report", "a.obj"),
    "of the sets": ("pvs", "a.obj", "-o", "a.pvs", "--report", "a.pvs"),
}


@pytest.mark.parametrize("arguments", IN_PLACE.values(), ids=IN_PLACE)
def test_nothing_that_is_read_or_written_besides_is_overwritten(
    command, tmp_path, monkeypatch, arguments
):
    """A report took the place of the mesh that it was about, and the status was 0."""
    for name in ("a.obj", "b.ply"):
        simplifier.save(as_occluder(box()), tmp_path / name)
    (tmp_path / "link.json").symlink_to("a.obj")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    monkeypatch.chdir(tmp_path)
    status, output, errors = command(*arguments)
    assert (status, output) == (1, "")
    assert "name another file" in one_line(errors)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
