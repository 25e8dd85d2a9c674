"""The meshes that convergence is shown on: solid and thin, round and flat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from bench.meshes import STAND_INS, mesh_named
from simplifier.geometry.mesh import TriangleMesh

_ASSETS = ("bunny_4968", "terrain", "machine")


@dataclass(frozen=True, eq=False)
class Subject:
    """A mesh, and what :func:`simplifier.simplify` is asked for beside its defaults."""

    name: str
    mesh: TriangleMesh
    options: dict[str, Any]


def subjects() -> Iterator[Subject]:
    """The castle of the examples, and those of the real assets that are there."""
    yield Subject("castle", mesh_named("castle"), {"ground": True})
    for stand_in in STAND_INS:
        if stand_in.name in _ASSETS and not stand_in.missing:
            yield Subject(stand_in.name, mesh_named(stand_in.name), stand_in.options)
