"""The measures of the report: closed forms over all directions, and how they scale."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.accuracy.occlusion import occlusion_measures
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from tests.solids import NOTHING, as_occluder, box, moved, sphere


def test_sphere():
    # All silhouettes are discs: pi R^3 / 3, less some percent for 64 flat sides and 128 pixels.
    ball = sphere(2.0, rings=32)
    measures = occlusion_measures(ball, as_occluder(ball))
    assert measures.original == pytest.approx(np.pi * 8.0 / 3.0, rel=0.03)
    assert measures.occluder == measures.original
    assert measures.ratio == 1.0


def test_a_smaller_sphere_has_the_cube_of_the_ratio():
    measures = occlusion_measures(sphere(1.0), as_occluder(sphere(0.5)))
    assert measures.ratio == pytest.approx(0.125, rel=0.05)


def test_a_flat_square_over_all_directions():
    # Seen at an angle t to its normal it is a rectangle of sides a and a |cos t|.
    a, cosines = 3.0, (np.arange(2000) + 0.5) / 2000
    expected = np.mean((a * cosines) ** 2 * a / 4 - (a * cosines) ** 3 / 12)
    square = box((a, a, 0.0), without=[0, 1, 2, 3, 5])
    measures = occlusion_measures(square, as_occluder(square))
    assert measures.original == pytest.approx(expected, rel=0.05)


def test_nothing_hides_nothing():
    measures = occlusion_measures(sphere(), NOTHING)
    assert measures.occluder == 0.0
    assert measures.ratio == 0.0


def test_too_large_an_occluder_has_more_than_the_original():
    assert occlusion_measures(sphere(1.0), as_occluder(sphere(1.2))).ratio > 1.2


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_cubes_of_the_scale(scale):
    whole, part = sphere(1.0), sphere(0.8)
    here = occlusion_measures(whole, as_occluder(part))
    there = occlusion_measures(moved(whole, scale), as_occluder(moved(part, scale)))
    assert there.original == pytest.approx(here.original * scale**3, rel=1e-9)
    assert there.ratio == pytest.approx(here.ratio, rel=1e-9)


def test_a_ratio_without_an_original():
    needle = TriangleMesh.from_soup([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0]], [[0, 1, 2]])
    measures = occlusion_measures(needle, Occluder(needle.vertices, needle.faces))
    assert (measures.original, measures.ratio) == (0.0, 0.0)


@pytest.mark.parametrize("size", [1e-140, 1e-100, 1e99])
def test_the_ratio_is_the_same_where_volumes_vanish(size):
    usual, other = box(), box(3 * (size,))
    half = np.s_[:6]
    ratios = [
        occlusion_measures(mesh, Occluder(mesh.vertices, mesh.faces[half])).ratio
        for mesh in (usual, other)
    ]
    assert ratios[1] == pytest.approx(ratios[0], rel=1e-6)
