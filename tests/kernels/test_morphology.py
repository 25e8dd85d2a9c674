"""Distances between voxels, against all pairs and against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.kernels.morphology import FAR, squared_distances

extent = st.integers(1, 9)


def by_all_pairs(sites, edge):
    """Squares of half voxels from each centre to the nearest cube of ``edge`` voxels."""
    voxels = np.indices(sites.shape).reshape(3, -1).T
    away = np.abs(voxels[:, None] - np.argwhere(sites)[None])
    gaps = np.maximum(2 * away - edge, 0)
    return (gaps**2).sum(axis=2).min(axis=1).reshape(sites.shape)


@settings(max_examples=80)
@given(
    st.tuples(extent, extent, extent),
    st.sampled_from([0, 1, 2]),
    st.floats(0.01, 0.7),
    st.integers(0, 2**32 - 1),
)
def test_all_pairs(shape, edge, density, seed):
    generator = np.random.default_rng(seed)
    sites = generator.random(shape) < density
    sites[tuple(generator.integers(0, shape))] = True
    before = sites.copy()
    found = squared_distances(sites, edge)
    assert found.dtype == np.int32
    assert np.array_equal(found, by_all_pairs(sites, edge))
    assert np.array_equal(sites, before)


@pytest.mark.sweep(4)
@pytest.mark.parametrize("shape", [(40, 33, 57), (1, 1, 200), (130, 2, 3)])
@pytest.mark.parametrize("density", [0.0005, 0.02])
def test_scipy_agrees_on_larger_grids(shape, density):
    sites = np.random.default_rng(5).random(shape) < density
    sites[-1, 0, 0] = True
    centres = ndimage.distance_transform_edt(~sites)
    np.testing.assert_allclose(squared_distances(sites, 0), 4.0 * centres**2, rtol=1e-12)
    # A cube of two voxels' edge reaches to the centres of its neighbours.
    grown = ndimage.binary_dilation(sites, np.ones((3, 3, 3)))
    cubes = ndimage.distance_transform_edt(~grown)
    np.testing.assert_allclose(squared_distances(sites, 2), 4.0 * cubes**2, rtol=1e-12)


@pytest.mark.parametrize("edge", [0, 1, 2])
def test_without_a_site_all_is_far(edge):
    assert (squared_distances(np.zeros((3, 4, 5), dtype=np.bool_), edge) == FAR).all()
    assert (squared_distances(np.ones((3, 4, 5), dtype=np.bool_), edge) == 0).all()


@pytest.mark.parametrize("edge", [0, 1, 2])
def test_the_longest_row(edge):
    sites = np.zeros((1, 1, 3100), dtype=np.bool_)
    sites[0, 0, -1] = True
    assert squared_distances(sites, edge)[0, 0, 0] == (2 * 3099 - edge) ** 2


def test_any_number_of_threads(monkeypatch):
    sites = np.random.default_rng(1).random((50, 60, 70)) < 0.01
    found = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        found.append(squared_distances(sites, 1))
    assert all(np.array_equal(found[0], other) for other in found[1:])
