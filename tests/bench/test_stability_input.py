"""What the benchmark of bad input measures."""

from __future__ import annotations

import numpy as np
import pytest

from bench.meshes import bumpy_sphere
from bench.stability.input import judged, nonsense_rows
from simplifier.geometry.mesh import TriangleMesh
from simplifier.io.formats import readable_suffixes


def test_nonsense_is_timed_under_every_suffix():
    rows = list(nonsense_rows(1 << 20))
    assert [row["file"] for row in rows] == ["zeros", "noise", "words", "one line"]
    assert all(
        row["suffixes"] == len(readable_suffixes()) and 0.0 < row["peak_MiB"] < 0.5 for row in rows
    )


@pytest.mark.slow
def test_a_mesh_is_judged_against_what_it_was():
    whole = bumpy_sphere(200)
    vertices = np.array(whole.vertices)
    vertices[0, 0] = 1e30
    row = judged("sphere", "far", whole, TriangleMesh.from_soup(vertices, whole.faces))
    assert row["warned"] == "dropped"
    assert row["dropped"] > 0
    assert row["recall"] > 0.3  # coarse, and with a hole
