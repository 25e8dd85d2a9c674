"""Directions that are even and repeatable, axes that are right-handed, spheres that hold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.views import (
    BoundingSphere,
    from_above,
    hemisphere_axes,
    hemisphere_directions,
    image_axes,
    random_directions,
)


@pytest.mark.parametrize("count", [1, 2, 3, 48, 1000])
def test_hemisphere_directions_are_units_above_the_equator(count):
    directions = hemisphere_directions(count)
    assert directions.shape == (count, 3)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    assert (directions[:, 2] > 0.0).all()


def test_hemisphere_directions_are_even():
    directions = hemisphere_directions(256)
    assert directions[:, 2].mean() == pytest.approx(0.5, abs=1e-12)  # uniform in height
    assert np.abs(directions[:, :2].mean(axis=0)).max() < 0.01
    cosines = np.abs(directions @ directions.T) - np.eye(256)
    nearest = np.degrees(np.arccos(cosines.max(axis=1).clip(max=1.0)))
    # A direction's share of the hemisphere is a cap of 3.6 degrees.
    assert nearest.min() > 3.0
    everywhere = random_directions(5000, 1)
    gap = np.degrees(np.arccos(np.abs(everywhere @ directions.T).max(axis=1)))
    assert gap.max() < 10.0


def test_random_directions_are_uniform_and_repeatable():
    directions = random_directions(20_000, 7)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    assert np.abs(directions.mean(axis=0)).max() < 0.02
    assert (directions.T @ directions) / 20_000 == pytest.approx(np.eye(3) / 3.0, abs=0.02)
    assert np.array_equal(directions, random_directions(20_000, 7))
    assert np.array_equal(directions[0], random_directions(20_000, 7)[0])
    assert not np.array_equal(directions, random_directions(20_000, 8))


def check_axes(directions, axes):
    assert axes.shape == (len(directions), 3, 3)
    assert axes[:, 2] == pytest.approx(directions)
    products = axes @ axes.transpose(0, 2, 1)
    assert products == pytest.approx(np.broadcast_to(np.eye(3), products.shape), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_axes_are_orthonormal_and_right_handed(seed):
    directions = random_directions(64, seed)
    check_axes(directions, image_axes(directions))


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 0.04, 0.05, 1.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_axes_near_the_pole(tilt, sign):
    directions = np.array([[np.sin(tilt), sign * np.cos(tilt), 0.0]])
    check_axes(directions, image_axes(directions))


def test_axes_of_a_hemisphere_are_made_once_and_cannot_be_changed():
    axes = hemisphere_axes(48)
    assert np.array_equal(axes, image_axes(hemisphere_directions(48)))
    assert hemisphere_axes(48) is axes
    assert not axes.flags.writeable


def test_v_is_up():
    level = random_directions(200, 3)
    level = level[np.abs(level[:, 1]) < 0.99]
    axes = image_axes(level)
    assert (axes[:, 1, 1] > 0.0).all()
    assert axes[:, 0, 1] == pytest.approx(0.0, abs=1e-15)
    assert image_axes(np.array([[0.0, 1.0, 0.0]]))[0, 1] == pytest.approx([0.0, 0.0, 1.0])
    assert image_axes(np.array([[0.0, 0.0, 1.0]]))[0].tolist() == np.eye(3).tolist()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-100, 1e-6, 1.0, 1e6, 1e90]))
def test_sphere_holds_all_vertices_and_touches_one(seed, scale):
    generator = np.random.default_rng(seed)
    points = generator.normal(size=(30, 3)) * generator.uniform(0.01, 1.0, 3) * scale
    sphere = BoundingSphere.of(TriangleMesh.from_soup(points, np.arange(30).reshape(-1, 3)))
    low, high = points.min(axis=0), points.max(axis=0)
    distances = np.linalg.norm((points - sphere.centre) / scale, axis=1)
    assert sphere.centre / scale == pytest.approx((low / 2 + high / 2) / scale, rel=1e-9, abs=1e-12)
    assert sphere.radius / scale == pytest.approx(distances.max(), rel=1e-12)


def test_sphere_of_a_flat_mesh():
    sphere = BoundingSphere.of(
        TriangleMesh.from_soup([[0, 0, 5], [4, 0, 5], [0, 3, 5]], [[0, 1, 2]])
    )
    assert sphere.centre.tolist() == [2.0, 1.5, 5.0]
    assert sphere.radius == pytest.approx(2.5)


@pytest.mark.parametrize("up", [0, 1, 2])
def test_from_above_turns_about_what_rises_and_nothing_else(up):
    directions = np.concatenate([random_directions(200, 3), np.eye(3), -np.eye(3)])
    looking = from_above(directions, up)
    assert (looking[:, up] <= 0.0).all()
    level_or_down = directions[:, up] <= 0.0
    assert np.array_equal(looking[level_or_down], directions[level_or_down])
    assert np.array_equal(looking[~level_or_down], -directions[~level_or_down])
