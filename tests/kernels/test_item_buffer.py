"""The picture of items against rays cast through every pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.item_buffer import ItemBuffer, Part
from simplifier.geometry.mesh import TriangleMesh
from tests.rasters import (
    LATTICE,
    hits,
    lattice_mesh,
    lattice_places,
    looking_ahead,
    random_camera,
    rays,
)

ROWS, COLUMNS = 23, 31


def soup(triangles):
    triangles = np.asarray(triangles, dtype=np.float64)
    faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    return TriangleMesh(triangles.reshape(-1, 3).copy(), faces)


def draw(triangles, camera, items):
    buffer = ItemBuffer(ROWS, COLUMNS)
    buffer.draw_parts([Part(soup(triangles), np.eye(4), np.asarray(items, np.int32))], camera)
    return buffer


@settings(max_examples=80)
@given(st.integers(0, 2**32 - 1))
def test_holds_the_item_that_a_ray_meets_first(seed):
    rng = np.random.default_rng(seed)
    camera, count = random_camera(rng), 6
    triangles = camera.position + rng.normal(size=(count, 3, 3)) * rng.choice([0.3, 2.0, 50.0])
    buffer = draw(triangles, camera, range(count))
    cast = [hits(triangle, camera, rays(camera, ROWS, COLUMNS)) for triangle in triangles]
    depths, doubt = np.array([c[0] for c in cast]), np.any([c[1] for c in cast], axis=0)
    expected = np.where(depths.max(axis=0) > 0.0, depths.argmax(axis=0), -1)
    assert (buffer.items == expected)[~doubt].all()
    sure = ~doubt & (expected >= 0)
    np.testing.assert_allclose(1.0 / buffer.depth[sure], depths.max(axis=0)[sure], rtol=1e-6)
    assert (buffer.visible == np.bincount(buffer.items[buffer.items >= 0], minlength=count)).all()
    least = ((depths > 0.0) & ~doubt).sum(axis=(1, 2))
    assert ((buffer.fragments >= least) & (buffer.fragments <= least + doubt.sum())).all()


@settings(max_examples=40)
@given(lattice_places)
def test_triangles_that_share_edges_cover_each_centre_once(places):
    mesh = lattice_mesh(places)
    if mesh is None:
        return
    _, vertices, faces, camera = mesh
    buffer = ItemBuffer(LATTICE, LATTICE)
    buffer.draw_parts([Part(TriangleMesh(vertices, faces), np.eye(4), 0)], camera)
    assert buffer.fragments[0] == np.count_nonzero(buffer.items == 0)


def test_of_equally_near_items_the_lowest_shows():
    triangle = [[-1.0, -1.0, 4.0], [1.0, -1.0, 4.0], [0.0, 1.0, 4.0]]
    camera = looking_ahead()
    for items in ([0, 1, 2], [2, 1, 0], [1, 0, 2]):
        buffer = draw([triangle] * 3, camera, items)
        assert buffer.visible[0] > 0
        assert buffer.visible[1:].tolist() == [0, 0]
        assert len(set(buffer.fragments.tolist())) == 1


@pytest.mark.parametrize(
    "triangle",
    [
        [[0.0, 0.0, 4.0]] * 3,
        [[-1.0, 0.0, 4.0], [0.0, 0.0, 4.0], [1.0, 0.0, 4.0]],
        [[-1.0, 0.0, -4.0], [0.0, 1.0, -4.0], [1.0, 0.0, -4.0]],  # behind
        [[np.nan, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
        [[-np.inf, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
        [[np.inf, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
        [[1e200, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
    ],
)
def test_draws_nothing_of_what_has_no_area_or_place(triangle):
    buffer = draw([triangle], looking_ahead(), [0])
    assert (buffer.items == -1).all()
    assert buffer.fragments.tolist() == [0]
    assert np.isinf(buffer.depth).all()
