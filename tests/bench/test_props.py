"""The props of the table, and its page."""

from __future__ import annotations

import shutil

import trimesh

from bench.props import RESULTS, kind_of, props
from bench.record import write_page


def test_every_prop_is_of_few_triangles_and_closed():
    made = dict(props())
    assert len(made) == 16
    opened = {name for name, mesh in made.items()
              if not trimesh.Trimesh(mesh.vertices, mesh.faces).is_watertight}  # fmt: skip
    assert opened <= {"crate", "rounded box"}  # of parts that meet, but for rounding
    assert all(100 < len(mesh.faces) < 20_000 for mesh in made.values())
    assert {kind_of(name) for name in made} == {"round ones", "flat ones"}


def test_the_page_of_props_is_current(tmp_path):
    for path in RESULTS.glob("props_*.csv"):
        shutil.copy(path, tmp_path)
    page = write_page(tmp_path, "props", ("draft", "balanced", "best"))
    assert page.read_text(encoding="utf-8") == (RESULTS / "props.md").read_text(encoding="utf-8")
