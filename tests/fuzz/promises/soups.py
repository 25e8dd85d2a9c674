"""Triangles that came out of a reader or out of the pipeline."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray, have_area
from tests.fuzz.promises import promise

FURTHEST = 1e100
"""Of a coordinate: beyond, volumes overflow."""


def check_soup(vertices: FloatArray, faces: IntArray) -> None:
    """Arrays as ``TriangleMesh`` and ``Occluder`` describe them; no triangle is without area."""
    promise(vertices.dtype == np.float64 and vertices.shape == (len(vertices), 3), "(n, 3) float64")
    promise(faces.dtype == np.int32 and faces.shape == (len(faces), 3), "(m, 3) int32")
    promise((np.abs(vertices) < FURTHEST).all(), "vertices are finite and within reach")
    promise(
        np.array_equal(np.unique(faces), np.arange(len(vertices))),
        "faces name every vertex, and nothing else",
    )
    promise(have_area(vertices[faces]).all(), "every triangle has an area")
    promise(not (vertices.flags.writeable or faces.flags.writeable), "arrays are read-only")


def is_closed(vertices: FloatArray, faces: IntArray) -> bool:
    """Whether every edge has triangles on both sides, judged by coordinates."""
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[faces]
    edges = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return bool((counts % 2 == 0).all())
