"""The castle's overrides are those of the castle, and of the documentation."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import simplifier
from examples.castle import castle
from simplifier.accuracy.deviation import deviation
from simplifier.geometry.mesh import as_mesh
from simplifier.options.stages import SolidOptions
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify

ROOT = Path(__file__).parents[2]
FILE = ROOT / "examples" / "castle.overrides.toml"


def test_what_is_drawn_lies_within_the_castle_and_nothing_stands_in_the_gate():
    overrides, mesh = simplifier.load_overrides(FILE), castle()
    solid = solidify(mesh, SolidOptions(64, ground=True), Stopwatch())
    for part in overrides.drawn:
        drawn = simplifier.Occluder(*as_mesh(part.triangles))
        assert deviation(drawn, mesh, solid.interior) < solid.core.cell_size
    (gate,) = overrides.open
    inner = type(gate.region)(
        gate.region.centre, gate.region.half * [0.9, 0.6, 1.0], gate.region.axes
    )
    assert not inner.crossed_by(mesh.vertices[mesh.faces]).any()


def test_the_documentation_shows_the_same_file():
    text = (ROOT / "docs" / "overrides.md").read_text(encoding="utf-8")
    shown = tomllib.loads(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])
    there = tomllib.loads(FILE.read_text(encoding="utf-8"))
    assert {key: shown[key] for key in there} == there
    assert set(shown) - set(there) == {"ignore"}
