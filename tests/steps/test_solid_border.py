"""Whether a mesh has a border, whatever its vertices are shared by."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.mesh import TriangleMesh
from simplifier.steps.solid import is_closed
from tests.solids import blob, box, joined, sphere, torus

CLOSED = {"box": box(), "ball": sphere(), "torus": torus(), "two": joined(box(), blob())}


def parted(mesh):
    """Each triangle with vertices of its own."""
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return TriangleMesh.from_soup(corners, np.arange(len(corners)).reshape(-1, 3))


@pytest.mark.parametrize("change", [lambda mesh: mesh, parted], ids=["shared", "parted"])
@pytest.mark.parametrize("name", CLOSED)
def test_one_face_less_opens_it(name, change):
    mesh = CLOSED[name]
    assert is_closed(change(mesh))
    for face in (0, len(mesh.faces) // 2, len(mesh.faces) - 1):
        rest = TriangleMesh.from_soup(mesh.vertices, np.delete(mesh.faces, face, axis=0))
        assert not is_closed(change(rest))


def test_both_zeros_are_one_place():
    mesh = parted(box())
    corners = mesh.vertices.copy()
    corners[::2][corners[::2] == 0.0] = -0.0
    assert is_closed(TriangleMesh.from_soup(corners, mesh.faces))


def test_windings_do_not_matter():
    mesh = sphere()
    faces = mesh.faces.copy()
    faces[::3] = faces[::3, ::-1]
    assert is_closed(TriangleMesh.from_soup(mesh.vertices, faces))
