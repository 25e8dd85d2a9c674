"""Meshes of fewer triangles that look the same from afar."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.accuracy.accuracy import view_masks
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import random_directions
from simplifier.refinement.reduce import first_faces, reduce_to
from tests.solids import sphere


def test_a_mesh_that_is_small_enough_stays_as_it_is() -> None:
    ball = sphere(rings=8)
    assert reduce_to(ball, len(ball.faces)) is ball


@pytest.mark.parametrize("offset", [0.0, 5e6])
def test_a_thinned_ball_has_the_silhouettes_of_the_ball(offset: float) -> None:
    ball = sphere(rings=160)
    ball = TriangleMesh.from_soup(ball.vertices + offset, ball.faces)
    few = reduce_to(ball, 10_000)
    assert 5_000 < len(few.faces) <= 10_000
    shown = Occluder(few.vertices, few.faces, error_bound=np.inf)
    whole, thin = view_masks(ball, shown, random_directions(4, 0), 256)
    assert (whole != thin).mean() < 0.01


@pytest.mark.parametrize("sides", [1, 2])
def test_an_open_sheet_keeps_its_border(sides: int) -> None:
    """All around but at its corners, which the mean of their cells cuts off; of two sides as well,
    of which each edge has two triangles."""
    across = np.arange(201)
    x, y = np.meshgrid(across, across, indexing="ij")
    corner = (201 * across[:-1, None] + across[:-1]).ravel()
    cells = [[corner, corner + 201, corner + 1], [corner + 1, corner + 201, corner + 202]]
    faces = np.concatenate([np.stack(cell, axis=1) for cell in cells])
    points = np.stack([x, y, 5.0 * np.sin(x / 20.0)], axis=-1).reshape(-1, 3)
    both = np.concatenate([faces, faces[:, ::-1]][:sides])
    few = reduce_to(TriangleMesh.from_soup(points, both), 1000)
    assert few.bounds[:, :2] == pytest.approx(np.array([[0.0, 0.0], [200.0, 200.0]]))
    edges = np.diff(few.vertices[few.faces], axis=1)
    assert np.cross(edges[:, 0], edges[:, 1])[:, 2].sum() / 2.0 > 0.99 * 200.0**2


@given(st.integers(0, 2**31), st.integers(1, 400), st.floats(1e-6, 1e6))
def test_specks_stay_few_and_somewhere_in_the_bounds(seed: int, most: int, size: float) -> None:
    random = np.random.default_rng(seed)
    middles = random.uniform(-1.0, 1.0, (500, 1, 3))
    specks = size * (middles + 1e-4 * random.normal(size=(500, 3, 3)))
    cloud = TriangleMesh.from_soup(specks.reshape(-1, 3), np.arange(1500).reshape(-1, 3))
    few = reduce_to(cloud, most)
    assert 1 <= len(few.faces) <= most
    slack = 1e-9 * size
    assert (few.bounds[0] >= cloud.bounds[0] - slack).all()
    assert (few.bounds[1] <= cloud.bounds[1] + slack).all()


@given(
    st.lists(st.permutations(range(6)), max_size=40),
    st.sampled_from([6, 2_000_000, 2_000_001, 2**31 - 1]),
)
def test_of_faces_with_the_same_corners_the_first_is_kept(orders, vertices):
    """Of any winding; three numbers of so many vertices do, and do not, fit into 64 bits."""
    faces = np.array([order[:3] for order in orders], dtype=np.int32).reshape(-1, 3)
    faces[faces == 5] = vertices - 1
    plain = {}
    for index, face in enumerate(faces.tolist()):
        plain.setdefault(tuple(sorted(face)), index)
    assert first_faces(faces, vertices).tolist() == [plain[key] for key in sorted(plain)]
