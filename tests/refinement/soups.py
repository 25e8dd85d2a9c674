"""A ball of voxels, views of it and soups in it, for tests of the search."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.coverage import coverage_masks
from simplifier.kernels.soup_views import UNIT, draw_union, score_unions
from simplifier.refinement.annealing import RefineViews
from tests.pictures import sphere_projections

SIZE = 24  # voxels a side


def ball(radius=9.0):
    """A ball of voxels in the middle of the grid."""
    centres = np.indices((SIZE,) * 3) + 0.5 - SIZE / 2
    return np.ascontiguousarray((centres**2).sum(axis=0) < radius**2)


def views_of(voxels, count=16):
    """Search views whose originals are the pictures of a ball of the solid's volume."""
    projections = sphere_projections(
        image_axes(hemisphere_directions(count)), np.full(3, SIZE / 2), SIZE / 2
    )
    rng = np.random.default_rng(5)
    points = rng.normal(size=(4000, 3))
    radius = np.cbrt(3.0 * voxels.sum() / (4.0 * np.pi))
    points = SIZE / 2 + radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    faces = np.array([[i, i + 1, i + 2] for i in range(0, 3999, 3)], dtype=np.int32)
    return RefineViews(
        projections, coverage_masks(points, faces, projections, 64, 64)[:, :, 0].copy()
    )


def crossed_quads(half=4.0):
    """Three squares through the centre: (6, 3, 3)."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    triangles = []
    for axis in range(3):
        corners = np.insert(square, axis, 0.0, axis=1) + SIZE / 2 + 0.25
        triangles += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return np.array(triangles)


def score(triangles, views, overcover=0.5, fine=0, toll=0):
    """The objective, drawn afresh."""
    count = len(views.projections)
    union = np.zeros((count, views.rows), np.uint64)
    soup = np.ascontiguousarray(triangles)
    draw_union(soup, views.projections, views.depths.arrays(), union)
    return score_unions(
        union, views.originals, round(UNIT * overcover),
        np.full((count, 2), (fine, toll), np.int64), np.zeros(count, np.int64),
    )  # fmt: skip
