"""Triangles drawn into a room beside a plain form, all of them at once in numpy: the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.room import Room
from simplifier.kernels.pull import pull_triangles
from simplifier.kernels.soup_views import all_contained

STEPS, PULLS, SHARE = np.array([0.0, 0.5, -0.5, 1.0]), 12, 0.125


def pulled(triangles, room):
    inside = np.zeros(len(triangles), dtype=np.bool_)
    for pull in range(PULLS + 1):
        if pull > 0:
            mean = triangles.mean(axis=1, keepdims=True)
            triangles = np.where(
                inside[:, None, None], triangles, triangles + SHARE * (mean - triangles)
            )
        a, b, c = triangles.transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1)[:, None], 1e-300)
        shape = triangles
        for step in STEPS:
            moved = np.ascontiguousarray(shape + step * normals[:, None])
            fits = np.zeros(len(moved), dtype=np.bool_)
            all_contained(moved, room, fits)
            fits &= ~inside
            triangles = np.where(fits[:, None, None], moved, triangles)
            inside |= fits
    return triangles, inside


def strewn(seed):
    """(60, 3, 3) about a box of 10 cells, some of them long, one without an area."""
    numbers = np.random.default_rng(seed)
    triangles = numbers.uniform(1.0, 13.0, (60, 1, 3)) + numbers.normal(0.0, 2.0, (60, 3, 3))
    triangles[7] = triangles[7, 0]
    return triangles


@pytest.mark.parametrize("seed", range(4))
def test_each_is_moved_and_shrunk_as_all_are_at_once(seed):
    allowed = np.zeros((14, 14, 14), dtype=np.bool_)
    allowed[2:12, 2:12, 2:12] = True
    room, found = Room.of(allowed).voxels, strewn(seed)
    inside = np.empty(len(found), dtype=np.bool_)
    wanted = pulled(strewn(seed), room)
    pull_triangles(found, room, STEPS, PULLS, SHARE, inside)
    assert np.array_equal(found, wanted[0])
    assert np.array_equal(inside, wanted[1])
    assert 0 < np.count_nonzero(inside) < len(found)
