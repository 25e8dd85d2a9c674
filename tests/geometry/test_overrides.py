"""Boxes turned in space, and what meets them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.overrides import Region

SEEDS = st.integers(0, 2**32 - 1)


def random_region(generator):
    rotation = generator.normal(size=4)
    return Region.of(generator.uniform(-1, 1, 3), generator.uniform(0.2, 2, 3), rotation)


def inside(region, points):
    """(n,) strictly."""
    return (np.abs((points - region.centre) @ region.axes.T) < region.half).all(axis=1)


def spread(generator, triangle, count):
    """(count, 3) points of a triangle."""
    shares = generator.dirichlet([1, 1, 1], count)
    return shares @ triangle


def test_a_turned_box_has_the_corners_that_geometry_says():
    half = np.sqrt(0.5)
    region = Region.of(np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 2.0]), np.array(
        [0.0, np.sin(np.pi / 8), 0.0, np.cos(np.pi / 8)]))  # 45 degrees about y  # fmt: skip
    corners = np.unique(region.triangles.reshape(-1, 3).round(12), axis=0)
    expected = [
        [1 + x, 2 + y, 3 + z]
        for x, z in ((0, 2 * half), (0, -2 * half), (2 * half, 0), (-2 * half, 0))
        for y in (-2, 2)
    ]
    assert np.allclose(corners, np.unique(np.round(expected, 12), axis=0))


def test_a_quarter_turn_about_y_takes_z_to_x():
    turned = Region.of(np.zeros(3), np.ones(3), np.array([0, np.sqrt(0.5), 0, np.sqrt(0.5)]))
    assert np.allclose(turned.axes, [[0, 0, -1], [0, 1, 0], [1, 0, 0]])


@given(SEEDS)
def test_the_surface_is_closed_wound_outwards_and_encloses_the_volume(seed):
    region = random_region(np.random.default_rng(seed))
    a, b, c = np.moveaxis(region.triangles - region.centre, 1, 0)
    volume = np.einsum("ni,ni->n", a, np.cross(b, c))
    assert (volume > 0).all()
    assert np.isclose(volume.sum() / 6.0, 8.0 * region.half.prod())


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_a_cube_with_a_point_inside_is_met_and_one_that_is_apart_is_not(seed):
    generator = np.random.default_rng(seed)
    region, half = random_region(generator), 0.2
    centres = generator.uniform(-2, 2, (40, 3))
    met = region.meets_boxes(centres, half)
    for centre, says in zip(centres, met, strict=True):
        points = np.concatenate([
            centre + generator.uniform(-half, half, (300, 3)),
            np.clip(region.centre + (generator.uniform(-1, 1, (300, 3)) * region.half)
                    @ region.axes, centre - half, centre + half),
        ])  # fmt: skip
        assert says or not inside(region, points).any()
    # Grown by a cube's half diagonal, the region has the centres of all cubes that meet it.
    grown = Region(region.centre, region.half + half * np.sqrt(3.0) + 1e-9, region.axes)
    assert not (met & ~inside(grown, centres)).any()


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_a_triangle_with_a_point_inside_crosses(seed):
    generator = np.random.default_rng(seed)
    region = random_region(generator)
    triangles = generator.uniform(-2, 2, (40, 3, 3))
    for triangle, says in zip(triangles, region.crossed_by(triangles), strict=True):
        if inside(region, spread(generator, triangle, 400)).any():
            assert says


def test_triangles_that_only_touch_do_not_cross():
    region = Region.of(np.zeros(3), np.full(3, 2.0), np.array([0.0, 0.0, 0.0, 1.0]))
    flush = np.array([[1.0, -5.0, -5.0], [1.0, 5.0, -5.0], [1.0, 0.0, 5.0]])
    little = np.array([1e-6, 0.0, 0.0])
    deeper, beside = flush - little, flush + little
    through = np.array([[-5.0, 0.0, 0.0], [5.0, 0.1, 0.0], [5.0, -0.1, 0.1]])
    assert region.crossed_by(np.stack([flush, deeper, beside, through])).tolist() == [
        False, True, False, True,
    ]  # fmt: skip
    tip = np.array([[1.0, 0.0, 0.0], [3.0, 1.0, 0.0], [4.0, -1.0, 1.0]])  # one axis parts them
    assert not region.crossed_by(np.stack([flush, -flush, tip, -tip])).any()
    assert not region.crossed_by(np.stack([deeper, -deeper]), 1e-5).any()
    assert not region.crossed_by(region.triangles).any()
    assert region.crossed_by(0.999 * region.triangles).all()


def test_a_triangle_around_the_region_without_touching_its_edges_is_seen():
    region = Region.of(np.zeros(3), np.full(3, 0.5), np.array([0.1, 0.7, 0.2, 0.6]))
    wide = np.array([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 12.0, 0.0]])
    assert region.crossed_by(wide[None]).all()
