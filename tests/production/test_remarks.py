"""What is said beside a verdict."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.production.remarks import misplaced
from tests.solids import as_occluder, box, sphere


def moved(mesh, scale=1.0, by=(0.0, 0.0, 0.0)):
    return as_occluder(TriangleMesh(mesh.vertices * scale + np.array(by), mesh.faces))


@pytest.mark.parametrize(
    ("scale", "by", "told"),
    [
        (1.0, (0.0, 0.0, 0.0), None),
        (0.9, (0.1, 0.0, 0.0), None),
        (0.2, (0.0, 0.0, 0.0), None),
        (1000.0, (0.0, 0.0, 0.0), "1,000 times as long as the mesh"),
        (0.01, (0.0, 0.0, 0.0), "1/100 as long as the mesh"),
        (1.0, (0.0, 5.0, 0.0), "wholly beside the mesh"),
        (1.0, (1e6, 0.0, 0.0), "wholly beside the mesh"),
    ],
)
def test_an_occluder_of_another_unit_or_place_is_told(scale, by, told):
    """Its verdict alone, of a recall of 0, did not say so."""
    found = misplaced(sphere(), moved(sphere(), scale, by))
    assert len(found) == (told is not None)
    assert told is None or told in found[0]


def test_an_occluder_of_no_triangles_is_nowhere():
    assert misplaced(box(), Occluder.of(np.empty((0, 3, 3)), 0.0, {})) == ()


def test_an_evaluation_says_so():
    far = simplifier.evaluate(box(), moved(box(), 1.0, (9.0, 0.0, 0.0)), views=4, image=32)
    assert "wholly beside the mesh" in far.warnings[0]
    assert "wholly beside the mesh" in far.report()["warnings"][0]
