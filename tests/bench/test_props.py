"""The props of the table."""

from __future__ import annotations

import trimesh

from bench.props import kind_of, props


def test_every_prop_is_of_few_triangles_and_closed():
    made = dict(props())
    assert len(made) == 16
    opened = {name for name, mesh in made.items()
              if not trimesh.Trimesh(mesh.vertices, mesh.faces).is_watertight}  # fmt: skip
    assert opened <= {"crate", "rounded box"}  # of parts that meet, but for rounding
    assert all(100 < len(mesh.faces) < 20_000 for mesh in made.values())
    assert {kind_of(name) for name in made} == {"round ones", "flat ones"}
