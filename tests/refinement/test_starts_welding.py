"""Equal positions become one vertex, and nothing else changes."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.options.stages import SolidOptions
from simplifier.progress import Stopwatch
from simplifier.refinement.starts import weld_vertices
from simplifier.steps.solid import solidify
from tests.solids import torus


def test_a_soup_is_the_surface_that_it_was_cut_from_in_its_order():
    mesh = torus(around=9, across=6)
    corners = mesh.vertices[mesh.faces]
    order = np.random.default_rng(1).permutation(len(corners))
    twice = np.concatenate([corners[order], corners[:, ::-1]])
    soup = TriangleMesh.from_soup(twice.reshape(-1, 3), np.arange(3 * len(twice)).reshape(-1, 3))
    grid = solidify(soup, SolidOptions(16), Stopwatch()).touched
    vertices, faces = weld_vertices(soup, grid)
    assert faces.dtype == np.int32
    assert len(vertices) == len(mesh.vertices)
    assert np.array_equal(vertices[faces], grid.to_grid(corners[order]))


def test_positions_that_all_but_coincide_stay_apart():
    nearly = np.nextafter(1.0, 2.0)
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [nearly, 0, 0], [1, 1, 0]])
    mesh = TriangleMesh.from_soup(points, [[0, 1, 2], [3, 4, 2]])
    grid = solidify(mesh, SolidOptions(4), Stopwatch()).touched
    assert len(weld_vertices(mesh, grid)[0]) == 5
