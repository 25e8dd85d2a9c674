"""Convex hulls of few triangles: convex, of the mesh's own points, and within the budget."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.failure import PeerFailedError
from bench.hulls import convex_hull
from tests.solids import blob, box, sphere


def past(points, faces, others):
    """How far each of ``others`` is outside of a hull, at most; its middle is inside."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    towards = np.einsum("ij,ij->i", normals, a - points[np.unique(faces)].mean(axis=0))
    normals *= np.sign(towards)[:, None]
    return ((others[:, None] - a) * normals).sum(axis=2).max()


@given(st.integers(0, 1000), st.sampled_from([8, 16, 30, 64]))
def test_a_thinned_hull_is_convex_and_of_the_points(seed, budget):
    cloud = np.random.default_rng(seed).normal(size=(200, 3))
    points, faces = convex_hull(cloud, np.arange(198).reshape(-1, 3), budget)
    assert 0 < len(faces) <= budget
    assert set(map(tuple, points)) <= set(map(tuple, cloud[:198]))
    assert past(points, faces, points) < 1e-9


def test_a_hull_within_the_budget_holds_all_of_the_mesh():
    mesh = blob(rings=6)
    points, faces = convex_hull(mesh.vertices, mesh.faces, 10_000)
    assert past(points, faces, mesh.vertices) < 1e-9


def test_points_that_no_face_names_do_not_count():
    mesh = box()
    stray = np.concatenate([mesh.vertices, [[9.0, 9.0, 9.0]]])
    points, faces = convex_hull(stray, mesh.faces, 12)
    assert len(faces) == 12
    assert points.max() == 1.0


def test_more_triangles_reach_further_out():
    ball = sphere(rings=12)
    missed = [past(*convex_hull(ball.vertices, ball.faces, n), ball.vertices) for n in (8, 32, 128)]
    assert missed == sorted(missed, reverse=True)
    assert missed[-1] < 0.1


@pytest.mark.parametrize(
    ("points", "budget", "why"),
    [
        (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]), 64, "no volume"),
        (sphere(rings=8).vertices, 4, "4 triangles hold no hull"),
    ],
)
def test_what_has_no_hull_says_why(points, budget, why):
    faces = np.arange(len(points) // 2 * 2).reshape(-1, 2)
    with pytest.raises(PeerFailedError, match=why):
        convex_hull(points, faces, budget)
