"""The smoothed boundary: closed, wound outwards, and near the solid's own."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.room import WHOLE
from simplifier.refinement.starts import inner_surface
from simplifier.voxel.fill import fill
from simplifier.voxel.voxelize import voxelize
from tests.solids import sphere


def surface_of(inside):
    return inner_surface(WHOLE * np.array(inside, np.uint8))


def volume(vertices, faces):
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float((a * np.cross(b, c)).sum()) / 6.0


def check_closed(faces):
    directed = Counter(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
    assert all(count == directed[(b, a)] for (a, b), count in directed.items())


@settings(max_examples=60)
@given(st.tuples(*[st.integers(1, 9)] * 3), st.floats(0.3, 1.0), st.integers(0, 2**32 - 1))
def test_random_solids(shape, density, seed):
    inside = np.random.default_rng(seed).random(shape) < density
    vertices, faces = surface_of(inside)
    assert vertices.dtype == np.float64
    assert faces.dtype == np.int32
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
    assert all(len(set(face)) == 3 for face in faces.tolist())
    check_closed(faces)
    padded = np.pad(inside, 5)
    for state in (True, False):
        centres = np.argwhere(padded == state) - 5 + 0.5
        apart = np.abs(vertices[:, None] - centres[None]).max(axis=2)
        assert (apart.min(axis=1, initial=np.inf) <= 3.0 + 1e-9).all()


def test_sphere_to_a_fraction_of_a_voxel():
    grid = fill(voxelize(sphere(1.0, rings=64), 40))
    vertices, faces = inner_surface(WHOLE * grid.inside.astype(np.uint8))
    radii = np.linalg.norm(grid.to_world(vertices), axis=1) / grid.cell_size
    check_closed(faces)
    assert 19.5 < radii.min() <= radii.max() < 21.0
    assert volume(vertices, faces) == pytest.approx(grid.count, rel=0.02)


@pytest.mark.parametrize("size", [20, 200])
def test_flat_sides_stay_where_they_are(size):
    """In cells of three voxels as well."""
    vertices, faces = surface_of(np.ones((size, size, size)))
    tall = -(-size // 3) * 3.0 if size > 95 else size
    assert vertices.min() == pytest.approx(0.0, abs=0.3)
    assert vertices.max() == pytest.approx(size, abs=tall - size + 0.3)
    assert volume(vertices, faces) == pytest.approx(size**3, rel=0.05)


@pytest.mark.parametrize("shape", [(1, 1, 1), (9, 1, 9), (1, 9, 1)])
def test_parts_of_one_voxel_vanish(shape):
    assert surface_of(np.ones(shape))[1].shape == (0, 3)


def test_empty_grid():
    vertices, faces = surface_of(np.zeros((4, 5, 6)))
    assert vertices.shape == faces.shape == (0, 3)


def test_cavity_is_wound_towards_its_inside():
    inside = np.ones((15, 15, 15))
    inside[5:10, 5:10, 5:10] = 0
    assert volume(*surface_of(inside)) < volume(*surface_of(np.ones((15, 15, 15)))) - 60.0
