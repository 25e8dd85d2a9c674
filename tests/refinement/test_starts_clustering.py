"""Clustering beside a plain dictionary of cells."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import VoxelGrid
from simplifier.refinement.starts import cluster_vertices
from simplifier.voxel.voxelize import voxelize
from tests.solids import box, sphere


def plain_clusters(mesh, grid, size):
    """Triples of cells and the mean of the vertices in each cell."""
    cells = {}
    top = np.ceil(np.array(grid.shape) / size).astype(int) - 1
    names = []
    for point in grid.to_grid(mesh.vertices):
        name = tuple(np.minimum((point / size).astype(int), top).tolist())
        cells.setdefault(name, []).append(point)
        names.append(name)
    triples = {frozenset(names[i] for i in face) for face in mesh.faces.tolist()}
    means = {name: np.mean(points, axis=0) for name, points in cells.items()}
    return means, {triple for triple in triples if len(triple) == 3}


@settings(max_examples=40)
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 60), st.sampled_from([1, 3, 9, 64, 100, 128]),
    st.sampled_from([0.0, 1e7]),
)  # fmt: skip
def test_as_the_plain_one(seed, count, resolution, far):
    random = np.random.default_rng(seed)
    points = random.random((40, 3)) * (1.0, 2.0, 0.3) + far
    mesh = TriangleMesh.from_soup(points, random.permuted(
        np.tile(np.arange(40), (count, 1)), axis=1)[:, :3])  # fmt: skip
    grid = voxelize(mesh, resolution)
    vertices, faces = cluster_vertices(mesh, grid)
    size = max(1.0, max(grid.shape) / 64)
    means, triples = plain_clusters(mesh, grid, size)
    assert vertices.dtype == np.float64
    assert faces.dtype == np.int32
    assert len(faces) == len(triples)
    expected = np.array(sorted(mean.tolist() for mean in means.values()))
    assert np.allclose(np.array(sorted(vertices.tolist())), expected, atol=1e-9)
    names = [frozenset(tuple(vertices[i].round(6)) for i in face) for face in faces]
    wanted = {frozenset(tuple(means[name].round(6)) for name in triple) for triple in triples}
    assert len(set(names) ^ wanted) <= 2  # rounding may differ
    places = grid.to_grid(mesh.vertices)
    nearest = np.linalg.norm(vertices[:, None] - places[None], axis=2).min(axis=1)
    assert (nearest <= np.sqrt(3.0) * size).all()


def test_few_triangles_stay_as_they_are():
    mesh = box((1.0, 2.0, 3.0))
    grid = voxelize(mesh, 64)
    vertices, faces = cluster_vertices(mesh, grid)
    assert len(faces) == 12
    assert np.allclose(grid.to_world(vertices)[faces], mesh.vertices[mesh.faces])


@pytest.mark.parametrize("resolution", [1, 2])
def test_what_is_in_one_cell_vanishes(resolution):
    mesh = TriangleMesh.from_soup([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [9, 9, 9]], [[0, 1, 2]])
    grid = VoxelGrid(np.zeros((resolution,) * 3, np.bool_), np.zeros(3), 9.0 / resolution)
    vertices, faces = cluster_vertices(mesh, grid)
    assert faces.shape == (0, 3)
    assert len(vertices) == 1


def test_fine_meshes_shrink_to_the_cells():
    ball = sphere(1.0, rings=200)
    _, faces = cluster_vertices(ball, voxelize(ball, 16))
    assert len(ball.faces) > 150_000
    assert 500 < len(faces) < 3500
