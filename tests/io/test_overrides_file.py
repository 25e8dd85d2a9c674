"""Overrides as files have them: what is read, and every fault with its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import OverridesError
from simplifier.io.overrides import load_overrides
from simplifier.io.suffixes import overrides_beside

WHOLE = """\
# of the castle
[[box]]
name = "keep"
center = [0, 10, 0]
size = [4, 20, 6]

[[box]]
center = [20.0, 1.0, 0.0]
size = [2, 2, 2]
angle = 90

[[quad]]
name = "curtain"
corners = [
  [30, 0, -5], [30, 8, -5],
  [30, 8, 5], [30, 0, 5],
]

[[open]]
name = "gate"
center = [0, 2, 28]
size = [4, 4, 3]
rotation = [0, 0, 0, 1]

[ignore]
meshes = ["flag*"]
materials = ["glass", "leaf?"]
transparent = "keep"
"""


def read(tmp_path: Path, text: str):
    path = tmp_path / "castle.overrides.toml"
    path.write_text(text)
    return load_overrides(path)


def test_messages_call_a_file_as_the_caller_does(tmp_path):
    path = tmp_path / "1234.toml"
    path.write_text(WHOLE)
    found = load_overrides(path, name="castle.overrides.toml")
    assert [part.where for part in found.drawn][:2] == [
        "castle.overrides.toml:2", "castle.overrides.toml:7",
    ]  # fmt: skip
    path.write_text("[[box]]\ncentre = 0\n")
    with pytest.raises(OverridesError) as refused:
        load_overrides(path, name="castle.overrides.toml")
    assert refused.value.where == "castle.overrides.toml:2"


def test_a_whole_file_is_read(tmp_path):
    found = read(tmp_path, WHOLE)
    assert [part.name for part in found.drawn] == ["keep", "box 2", "curtain"]
    assert [len(part.triangles) for part in found.drawn] == [12, 12, 2]
    keep = found.drawn[0].triangles.reshape(-1, 3)
    assert keep.min(axis=0).tolist() == [-2, 0, -3]
    assert keep.max(axis=0).tolist() == [2, 20, 3]
    assert np.unique(found.drawn[2].triangles.reshape(-1, 3), axis=0).tolist() == [
        [30, 0, -5], [30, 0, 5], [30, 8, -5], [30, 8, 5],
    ]  # fmt: skip
    assert len(found.triangles) == 26
    (gate,) = found.open
    assert (gate.name, gate.region.half.tolist()) == ("gate", [2, 2, 1.5])
    assert str(gate) == f"gate ({tmp_path / 'castle.overrides.toml'}:19)"
    assert [pattern.text for pattern in found.ignore.materials] == ["glass", "leaf?"]
    assert found.ignore.meshes[0].where.endswith(":26")
    assert found.ignore.see_through is False


def test_viewers_are_places(tmp_path):
    text = '[[viewer]]\nat = [1, 2, 3]\n[[viewer]]\nname = "bar"\nat = [4, 5, 6.5]\n'
    assert read(tmp_path, text).viewers.tolist() == [[1, 2, 3], [4, 5, 6.5]]
    assert read(tmp_path, "# nobody\n").viewers.shape == (0, 3)


def test_a_file_of_comments_overrides_nothing(tmp_path):
    found = read(tmp_path, "# later\n")
    assert (found.drawn, found.open, found.ignore.see_through) == ((), (), True)


def test_an_angle_turns_about_y_unless_another_axis_is_named(tmp_path):
    row = "[[box]]\ncenter = [0, 0, 0]\nsize = [2, 4, 6]\nangle = {}\n"
    about = {
        axis: np.abs(read(tmp_path, row.format(turn)).drawn[0].triangles).max(axis=(0, 1)).round(9)
        for axis, turn in (("y", "90"), ("x", '90\naxis = "x"'), ("z", '-90\naxis = "z"'))
    }
    assert {axis: size.tolist() for axis, size in about.items()} == {
        "y": [3, 2, 1], "x": [1, 3, 2], "z": [2, 1, 3],
    }  # fmt: skip


def test_a_concave_quad_is_cut_along_its_inner_diagonal(tmp_path):
    corners = "[[0, 0, 0], [4, 0, 0], [1, 1, 0], [0, 4, 0]]"
    (part,) = read(tmp_path, f"[[quad]]\ncorners = {corners}\n").drawn
    edges = part.triangles[:, 1:] - part.triangles[:, :1]
    assert np.abs(np.cross(edges[:, 0], edges[:, 1])[:, 2]).sum() / 2 == 4.0


BOX = "[[box]]\ncenter = [0, 0, 0]\nsize = [1, 1, 1]\n"


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("x = 1\n", 1, "no key 'x' at the top; choose from box, quad, open, viewer, ignore"),
        (BOX + "sise = 1\n", 4, r"there is no key 'sise' in \[\[box\]\]"),
        (BOX + "corners = []\n", 4, "there is no key 'corners'"),
        ("\n[[open]]\ncenter = [0, 0, 0]\n", 2, "'size' is missing; give a list of 3"),
        ("[[box]]\ncenter = [0, 0]\nsize = [1, 1, 1]\n", 2, "'center' is not 3 finite numbers"),
        ("[[box]]\ncenter = [0, 0, nan]\nsize = [1, 1, 1]\n", 2, "'center' is not 3 finite"),
        ("[[box]]\ncenter = [0, 0, true]\nsize = [1, 1, 1]\n", 2, "'center' is not 3 finite"),
        ("[[box]]\ncenter = [0, 0, 0]\nsize = [1, 0, 1]\n", 3, "'size' has an edge that is not"),
        (BOX.replace("0]", "1e17]"), 2, "'center' is so far off that rounding flattens the size"),
        (BOX * 1001, 3001, r"there are 1,001 of \[\[box\]\]; keep the 1,000 that matter most"),
        (BOX + "rotation = [0, 0, 0, 2]\n", 4, "'rotation' is no unit quaternion"),
        (BOX + "angle = 3\nrotation = [0, 0, 0, 1]\n", 5, "'rotation' stands beside an angle"),
        (BOX + 'angle = "3"\n', 4, "'angle' is '3'"),
        (BOX + 'axis = "w"\n', 4, "'axis' is 'w'; choose x, y or z"),
        (BOX + 'name = ""\n', 4, "'name' is no text"),
        ("[box]\ncenter = [0, 0, 0]\n", 1, r"'box' is not a table of its own; write \[\[box\]\]"),
        ("[[quad]]\ncorners = [[0, 0, 0]]\n", 2, "'corners' are not four points"),
        ("[[quad]]\n\ncorners = [1, 2, 3, 4]\n", 3, "'corners' hold 1"),
        (
            "[[quad]]\ncorners = [[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]\n", 2,
            "'corners' make no quad",
        ),
        (
            "[[quad]]\ncorners = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]\n", 2,
            "'corners' make no quad",
        ),
        ("[[viewer]]\nat = [1, 2]\n", 2, "'at' is not 3 finite numbers"),
        ("[[viewer]]\neye = [1, 2, 3]\n", 2, r"there is no key 'eye' in \[\[viewer\]\]"),
        ("[[ignore]]\n", 1, "'ignore' is not a table"),
        ("[ignore]\nmesh = []\n", 2, r"there is no key 'mesh' in \[ignore\]"),
        ("[ignore]\nmeshes = 'glass'\n", 2, "'meshes' is not a list of names"),
        ("[ignore]\nmaterials = ['a', '']\n", 2, "'materials' is not a list of names"),
        ("[ignore]\ntransparent = 'no'\n", 2, "'transparent' is 'no'; choose leave-out or keep"),
        ("[[box]\n", 1, "is no TOML"),
        (
            BOX + "[[open]]\nname = 'door'\ncenter = [0.9, 0, 0]\nsize = [1, 1, 1]\n", 1,
            r"'box 1' reaches into the open region door \(.*:4\); make one of them smaller",
        ),
    ],
)  # fmt: skip
def test_a_fault_is_told_with_its_line(tmp_path, text, line, what):
    path = tmp_path / "castle.overrides.toml"
    with pytest.raises(OverridesError, match=what) as refused:
        read(tmp_path, text)
    assert str(refused.value).startswith(f"{path}:{line}: ")


def test_parts_flush_with_an_open_region_are_fine(tmp_path):
    read(tmp_path, BOX + "[[open]]\ncenter = [1, 0, 0]\nsize = [1, 1, 1]\n")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(OverridesError, match="there is no such file"):
        load_overrides(tmp_path / "none.toml")


def test_the_file_beside_a_mesh_has_its_name(tmp_path):
    mesh = tmp_path / "old.castle.glb"
    assert overrides_beside(mesh) is None
    beside = tmp_path / "old.castle.overrides.toml"
    beside.write_text("")
    assert overrides_beside(mesh) == beside
