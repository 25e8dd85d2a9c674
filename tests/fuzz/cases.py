"""Cases of what takes meshes and options, as JSON: coordinates come back to the last bit.

    simplify   {"mesh": MESH, "options": {...}}
    evaluate   {"mesh": MESH, "occluder": MESH, "options": {...}}
    scene      {"meshes": [MESH, ...], "mesh_of": [...], "transforms": [4 x 4, ...],
                "options": {...}, "cameras": [{"position", "forward", "fov", "near"}, ...]}

A MESH is {"vertices": [[x, y, z], ...], "faces": [[a, b, c], ...]}; NaN and infinities are written
as Python's json does.
"""

from __future__ import annotations

import json
from typing import Any

from simplifier.geometry.mesh import TriangleMesh

Case = dict[str, Any]
Soup = dict[str, list[Any]]


def write_case(case: Case) -> bytes:
    """One line."""
    return (json.dumps(case) + "\n").encode()


def read_case(data: bytes) -> Case:
    case = json.loads(data)
    assert isinstance(case, dict)
    return case


def mesh_of(soup: Soup) -> TriangleMesh:
    """Raises ``MeshError``."""
    return TriangleMesh.from_soup(soup["vertices"], soup["faces"])


def soup_of(mesh: TriangleMesh) -> Soup:
    return {"vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist()}


def soups_of(case: Case) -> list[Soup]:
    """Every mesh of a case, to be changed in place."""
    single = [case[name] for name in ("mesh", "occluder") if name in case]
    return single + list(case.get("meshes", []))
