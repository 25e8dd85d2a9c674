"""Triangles by a box: nothing is lost, nothing is drawn twice, and each part is on its side."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.visibility.pictures.cut_mesh import areas, creases, outside, within

BOX = np.array([[0.2, 0.3, 0.1], [0.6, 0.9, 0.5]])


def test_what_is_left_covers_all_that_is_out_of_the_box():
    rng = np.random.default_rng(0)
    triangles = rng.random((40, 3, 3))
    left = outside(triangles, BOX)
    hair = 1e-12
    assert not ((left > BOX[0] + hair) & (left < BOX[1] - hair)).all(axis=2).any(axis=1).any()
    # Points of each triangle, evenly: those out of the box are as many as the area that is left.
    weights = rng.dirichlet((1.0, 1.0, 1.0), 20_000)
    points = np.einsum("pk,nkd->npd", weights, triangles)
    out = ~((points >= BOX[0]) & (points <= BOX[1])).all(axis=2)
    assert areas(left).sum() == pytest.approx((out.mean(axis=1) * areas(triangles)).sum(), rel=3e-3)


def test_what_lies_in_a_side_of_the_box_counts_as_out():
    level = np.array([[[0.3, 0.4, 0.5], [0.5, 0.4, 0.5], [0.3, 0.8, 0.5]]])
    assert areas(outside(level, BOX)).sum() == pytest.approx(areas(level).sum())
    assert len(outside(level - [0.0, 0.0, 0.1], BOX)) == 0


def test_windings_stay():
    triangle = np.array([[[0.0, 0.0, 0.3], [1.0, 0.0, 0.3], [0.0, 1.0, 0.3]]])
    left = outside(triangle, BOX)
    ups = np.cross(left[:, 1] - left[:, 0], left[:, 2] - left[:, 0])[:, 2]
    assert (ups >= 0.0).all()
    assert ups.sum() > 0.0


def test_creases_are_where_surfaces_turn_or_end():
    a, b, c, d = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)
    flat = np.array([[a, b, c], [a, c, d]])
    assert len(creases(flat)) == 4  # without the diagonal
    folded = np.array([[a, b, c], [a, c, (0.0, 1.0, 1.0)]])
    assert len(creases(folded)) == 5


def test_lines_are_cut_at_the_box():
    lines = np.array([
        [(-1.0, 0.5, 0.3), (1.0, 0.5, 0.3)], [(0.3, 0.0, 0.0), (0.3, 0.1, 1.0)],
        [(0.4, 0.4, 0.2), (0.4, 0.4, 0.3)],
    ])  # fmt: skip
    np.testing.assert_allclose(
        within(lines, BOX),
        [[(0.2, 0.5, 0.3), (0.6, 0.5, 0.3)], [(0.4, 0.4, 0.2), (0.4, 0.4, 0.3)]],
        atol=1e-15,
    )
