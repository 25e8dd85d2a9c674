"""Overrides, by the real command."""

from __future__ import annotations

import json

import numpy as np
import pytest

import simplifier
from tests.acceptance.command import occluder
from tests.io.builders import cubes
from tests.schema import check_report
from tests.solids import as_occluder, box, joined

QUICK = (
    "--resolution", "12", "--preset", "draft", "--moves", "100", "--views", "4", "--image", "32",
    "--quads", "50", "--budget", "20",
)  # fmt: skip
WALL, GLASS, VINES = {"name": "wall"}, {"name": "glass", "alphaMode": "BLEND"}, {"name": "vines"}
OVERRIDES = """\
[[box]]
name = "pillar"
center = [0.5, 0.5, 0.5]
size = [0.25, 1.0, 0.25]

[[open]]
name = "slot"
center = [0.0, 0.5, 0.5]
size = [0.3, 0.5, 0.5]

[ignore]
materials = ["vine*"]
"""


@pytest.fixture
def place(tmp_path):
    (tmp_path / "castle.glb").write_bytes(cubes(WALL, GLASS, VINES))
    (tmp_path / "castle.overrides.toml").write_text(OVERRIDES)
    return tmp_path


def test_the_file_beside_the_mesh_is_found_and_done(place, here):
    done = occluder(
        "simplify", place / "castle.glb", "-o", place / "out.glb", "--report",
        place / "report.json", *QUICK,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = "12 see-through triangles were left out (material 'glass'), 12 ignored triangles were"
    assert told in " ".join(done.stderr.replace("│", " ").split() + done.stdout.split())
    report = json.loads((place / "report.json").read_text())
    check_report(report)
    assert report["input"]["triangles"] == 12
    assert [one["name"] for one in report["input"]["omitted"]] == [
        "material 'glass'", "material 'vines'",
    ]  # fmt: skip
    assert report["options"]["overrides"] == {
        "drawn": ["pillar"], "triangles": 12, "open": ["slot"], "viewers": 0,
    }  # fmt: skip
    found = simplifier.load_occluder(place / "out.glb")
    overrides = simplifier.load_overrides(place / "castle.overrides.toml")
    drawn = overrides.triangles.reshape(-1, 1, 3)
    assert np.abs(drawn - found.vertices).max(axis=2).min(axis=1).max() < 1e-6
    triangles = found.vertices[found.faces]
    assert not overrides.open[0].region.crossed_by(triangles).any()
    judged = here("evaluate", place / "castle.glb", place / "out.glb", "--report",
                  place / "judged.json", *QUICK[-6:-2])  # fmt: skip
    assert judged.returncode == 0, judged.stderr
    again = json.loads((place / "judged.json").read_text())
    check_report(again)
    assert again["input"]["triangles"] == 12


def test_without_overrides_all_that_is_opaque_counts_and_keep_takes_the_rest(place, command):
    for more, triangles in ((), 24), (("--transparent", "keep"), 36):
        code, _, errors = command(
            "simplify", place / "castle.glb", "-o", place / "out.glb", "--no-overrides",
            "--report", place / "report.json", *QUICK, *more,
        )  # fmt: skip
        assert code == 0, errors
        report = json.loads((place / "report.json").read_text())
        assert report["input"]["triangles"] == triangles
        assert report["options"]["overrides"] is None


def test_what_a_viewer_sees_stays_open(tmp_path, command):
    """A closed hall with another box in it: who stands in the hall sees all of it."""
    hall = joined(box((8, 8, 8)), box((1, 1, 1), (1, 1, 1)))
    simplifier.save(as_occluder(hall), tmp_path / "hall.glb")
    (tmp_path / "by_hand.toml").write_text("[[viewer]]\nat = [5, 5, 5]\n")
    solids = []
    for given in (("--no-overrides",), ("--overrides", tmp_path / "by_hand.toml")):
        code, _, errors = command(
            "simplify", tmp_path / "hall.glb", "-o", tmp_path / "out.glb", *given, "--report",
            tmp_path / "report.json", *QUICK, "--budget", "12",
        )  # fmt: skip
        assert code == 0, errors
        report = json.loads((tmp_path / "report.json").read_text())
        check_report(report)
        solids.append(report["solid"]["inside_fraction"])
    assert solids[0] == 1.0
    assert solids[1] < 0.6
    assert report["options"]["overrides"]["viewers"] == 1
    assert any("viewers inside see it" in one for one in report["decisions"])


def test_another_file_can_be_named(place, command):
    other = place / "other.toml"
    other.write_text('[ignore]\nmaterials = ["wall"]\n')
    code, _, errors = command(
        "simplify", place / "castle.glb", "-o", place / "out.glb", "--overrides", other, "--report",
        place / "report.json", *QUICK,
    )  # fmt: skip
    assert code == 0, errors
    report = json.loads((place / "report.json").read_text())
    assert np.allclose(report["input"]["bounds"], [[6, 0, 0], [7, 1, 1]])


@pytest.mark.parametrize(
    ("text", "line", "what", "code"),
    [
        ("[ignore]\n\nmaterials = ['vine*', 'ivy']\n", ":3", "no material is called 'ivy'", 1),
        ("[[box]]\ncentre = [0, 0, 0]\n", ":2", "there is no key 'centre'", 1),
        ("[[box]]\ncenter = [0, 0,\n", ":2", "is no TOML", 1),
    ],
)
def test_a_fault_is_one_line_with_its_place_and_nothing_is_written(
    place, command, text, line, what, code
):
    (place / "castle.overrides.toml").write_text(text)
    for verb in (("simplify", place / "castle.glb", "-o", place / "out.glb"),
                 ("evaluate", place / "castle.glb", place / "castle.glb")):  # fmt: skip
        found, _, errors = command(*verb)
        assert found == code
        assert errors.startswith(f"error: {place / 'castle.overrides.toml'}{line}: ")
        assert what in errors
        assert errors.count("\n") == 1
    assert not (place / "out.glb").exists()


def test_a_budget_below_what_is_drawn_is_wrong_usage(place, command):
    code, _, errors = command(
        "simplify", place / "castle.glb", "-o", place / "out.glb", "--budget", "11"
    )
    assert code == 2
    assert "11 triangles are fewer than the 12 that the overrides draw" in errors


def test_a_file_and_none_cannot_both_be_asked_for(place, command):
    code, _, errors = command(
        "simplify", place / "castle.glb", "-o", place / "out.glb", "--no-overrides", "--overrides",
        place / "castle.overrides.toml",
    )  # fmt: skip
    assert (code, "choose one of the two" in errors) == (2, True)


def test_scenes_leave_out_what_one_can_see_through(place, command):
    (place / "castle.glb").write_bytes(cubes(GLASS))
    for verb in (("scene", place / "castle.glb"), ("path", place / "castle.glb")):
        code, _, errors = command(*verb, "-o", place / "built.json")
        assert code == 1
        assert "all of it is see-through; keep them with --transparent keep" in errors
    code, _, errors = command(
        "path", place / "castle.glb", "-o", place / "built.json", "--frames", "2", "--kind", "roof",
        "--transparent", "keep",
    )  # fmt: skip
    assert code == 0, errors
