"""The voxel mesh: closed, wound outwards, and exactly as large as the solid."""

from __future__ import annotations

from collections import Counter
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.surface import voxel_mesh


def mesh_of(inside):
    return voxel_mesh(VoxelGrid(np.array(inside, dtype=np.bool_), np.zeros(3), 1.0))


def signed_volume_times_six(vertices, faces):
    a, b, c = vertices[faces].astype(np.int64).transpose(1, 0, 2)
    return int((a * np.cross(b, c)).sum())


def check_mesh(inside):
    inside = np.asarray(inside, dtype=np.bool_)
    vertices, faces = mesh_of(inside)
    assert vertices.dtype == faces.dtype == np.int32
    assert vertices.shape[1:] == faces.shape[1:] == (3,)
    assert signed_volume_times_six(vertices, faces) == 6 * np.count_nonzero(inside)
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
    check_edges(faces)
    check_faces(inside, vertices, faces)


def check_edges(faces):
    """Each directed edge as often as its reverse: undirected, an even number of times."""
    directed = Counter(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
    assert all(count == directed[(b, a)] for (a, b), count in directed.items())
    assert all(count in (1, 2) for count in directed.values())


def check_faces(inside, vertices, faces):
    """Half a unit in front of every triangle lies an outside voxel, half a unit behind an inside
    one; and both halves of every boundary face are there, once."""
    corners = vertices[faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.abs(normals).sum(axis=1) == 1).all()
    padded = np.pad(inside, 1)
    middles = corners.mean(axis=1)
    for side, expected in ((0.5, False), (-0.5, True)):
        i, j, k = (np.floor(middles + side * normals).astype(np.int64) + 1).T
        assert (padded[i, j, k] == expected).all()
    whole = padded.astype(np.int8)
    boundary = sum(int(np.abs(np.diff(whole, axis=axis)).sum()) for axis in range(3))
    assert len(faces) == 2 * boundary
    assert len(np.unique(np.sort(faces, axis=1), axis=0)) == len(faces)


@settings(max_examples=80, deadline=None)
@given(st.tuples(*[st.integers(1, 6)] * 3), st.floats(0.05, 0.95), st.integers(0, 2**32 - 1))
def test_random_solids(shape, density, seed):
    check_mesh(np.random.default_rng(seed).random(shape) < density)


def test_single_voxel_is_a_cube():
    vertices, faces = mesh_of(np.ones((1, 1, 1)))
    assert vertices.tolist() == [list(corner) for corner in product((0, 1), repeat=3)]
    assert len(faces) == 12
    check_mesh(np.ones((1, 1, 1)))


@pytest.mark.parametrize("shape", [(4, 3, 2), (1, 5, 5), (70, 1, 2)])
def test_full_grid_is_a_box_because_the_border_counts_as_outside(shape):
    check_mesh(np.ones(shape))
    nx, ny, nz = shape
    assert len(mesh_of(np.ones(shape))[1]) == 4 * (nx * ny + ny * nz + nz * nx)


def test_empty_grid_gives_an_empty_mesh():
    vertices, faces = mesh_of(np.zeros((3, 2, 4)))
    assert vertices.shape == faces.shape == (0, 3)


@pytest.mark.parametrize(
    "second", [c for c in product((-1, 0, 1), repeat=3) if c > (0, 0, 0) and np.abs(c).sum() > 1]
)
def test_voxels_that_touch_diagonally(second):
    """Along a shared edge four faces meet; at a shared corner the mesh is pinched."""
    inside = np.zeros((3, 3, 3), dtype=np.bool_)
    inside[1, 1, 1] = inside[tuple(np.add(second, 1))] = True
    check_mesh(inside)
    vertices, faces = mesh_of(inside)
    undirected = Counter(
        map(tuple, np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).tolist())
    )
    shared_edges = 1 if np.abs(second).sum() == 2 else 0
    assert sum(count == 4 for count in undirected.values()) == shared_edges
    assert len(vertices) == 16 - (2 if shared_edges else 1)


@pytest.mark.parametrize("phase", [0, 1])
def test_checkerboard(phase):
    check_mesh(np.indices((5, 4, 6)).sum(axis=0) % 2 == phase)


def test_cavity_is_wound_towards_its_inside():
    inside = np.ones((3, 3, 3))
    inside[1, 1, 1] = 0
    check_mesh(inside)
    assert len(mesh_of(inside)[1]) == 2 * (54 + 6)


def test_mesh_does_not_depend_on_where_the_grid_lies():
    inside = np.random.default_rng(3).random((4, 5, 6)) < 0.5
    expected = mesh_of(inside)
    moved = voxel_mesh(VoxelGrid(inside.copy(), np.array([5.0, -2.0, 1e6]), 0.01))
    assert all(np.array_equal(a, b) for a, b in zip(expected, moved, strict=True))


def test_large_coordinates_fit():
    inside = np.zeros((1024, 1, 1024), dtype=np.bool_)
    inside[-1, 0, -1] = True
    vertices, _ = mesh_of(inside)
    assert vertices.max(axis=0).tolist() == [1024, 1, 1024]
    assert vertices.min(axis=0).tolist() == [1023, 0, 1023]
