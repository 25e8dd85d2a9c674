"""The plates of the table."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from bench.plates import OUTLINES, THICK, kind_of, plates


def test_every_plate_is_as_thick_as_its_kind_says():
    made = dict(plates())
    assert len(made) == len(OUTLINES) * len(THICK)
    for name, mesh in made.items():
        points = mesh.vertices - mesh.vertices.mean(axis=0)
        thinnest = np.linalg.eigh(points.T @ points)[1][:, 0]
        assert np.ptp(points @ thinnest) == pytest.approx(THICK[name.partition(", ")[2]], abs=1e-9)
        assert mesh.extent.max() < 1.2
        closed = trimesh.Trimesh(mesh.vertices, mesh.faces).is_watertight
        assert closed == (kind_of(name) != "flat ones")
    assert {kind_of(name) for name in made} == {"flat ones", "sheets", "plates", "slabs"}
