"""Triangles that leave the solid are pulled into it, and those that cannot be are left out."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.room import Room
from simplifier.kernels.voxelize import is_contained
from simplifier.refinement.search import pull_into

SIZE = 12


def keeps_to(triangle, allowed):
    return is_contained(*(tuple(corner) for corner in triangle.tolist()), Room.of(allowed).voxels)


def plain_pull(triangle, allowed):
    """Smaller by sixteenths, at each size moved along the normal and back by half voxels."""
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    normal = normal / max(np.linalg.norm(normal), 1e-300)
    for _ in range(49):
        for shift in (0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5, 2.0, -2.0):
            if keeps_to(triangle + shift * normal, allowed):
                return triangle + shift * normal
        triangle = triangle + (triangle.mean(axis=0) - triangle) / 16.0
    return None


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 8))
def test_same_as_one_by_one(seed, count):
    rng = np.random.default_rng(seed)
    allowed = np.ones((SIZE,) * 3, dtype=np.bool_)
    allowed[tuple(rng.integers(0, SIZE, (3, 6)))] = False
    soup = rng.uniform(-1.0, SIZE + 1.0, (count, 1, 3)) + rng.uniform(-3.0, 3.0, (count, 3, 3))
    before = soup.copy()
    found = pull_into(soup, Room.of(allowed))
    assert np.array_equal(soup, before)
    assert all(keeps_to(one, allowed) for one in found)
    expected = [one for one in (plain_pull(one, allowed) for one in soup) if one is not None]
    np.testing.assert_allclose(found, np.reshape(expected, (-1, 3, 3)), rtol=0.0, atol=1e-9)
    as_they_were = [one for one in soup if keeps_to(one, allowed)]
    assert all((found == one).all(axis=(1, 2)).any() for one in as_they_were)


def test_one_that_lies_along_a_wall_of_the_room_moves_and_keeps_its_size():
    """A room that narrows late took most of a terrain: its sheets shrank to a tenth."""
    allowed = np.zeros((SIZE,) * 3, dtype=np.bool_)
    allowed[:, :, 5] = True
    sheet = np.array([[[0.5, 0.5, 6.1], [11.5, 0.5, 6.3], [0.5, 11.5, 6.2]]])
    (found,) = pull_into(sheet, Room.of(allowed))
    assert keeps_to(found, allowed)
    edges = (np.roll(one, -1, axis=0) - one for one in (found, sheet[0]))
    np.testing.assert_allclose(*(np.linalg.norm(one, axis=1) for one in edges), rtol=1e-12)


def test_it_moves_by_voxels_of_the_room_not_by_cells():
    """Two of these at most; what lies further along a wall would be another part's."""
    allowed = np.zeros((2 * SIZE,) * 3, dtype=np.bool_)
    allowed[:, :, 10] = True
    fine = Room.of(allowed)
    cells = np.minimum.reduceat(fine.layers, np.arange(0, 2 * SIZE, 2), axis=0)
    cells = np.minimum.reduceat(cells, np.arange(0, 2 * SIZE, 2), axis=1)
    cells = np.ascontiguousarray(np.minimum.reduceat(cells, np.arange(0, 2 * SIZE, 2), axis=2))
    most = np.full_like(cells, fine.layers.max())
    room = Room(fine.layers, cells, most, cells, 0, (0.0,), 0.0)
    sheet = np.array([[0.5, 0.5, 0.0], [11.5, 0.5, 0.0], [0.5, 11.5, 0.0]])
    for height, found in ((6.25, 1), (6.75, 0), (7.25, 0)):
        assert len(pull_into(sheet[None] + [0.0, 0.0, height], room)) == found


def test_one_without_an_area_has_no_normal_and_shrinks():
    allowed = np.ones((SIZE,) * 3, dtype=np.bool_)
    line = np.array([[[6.0, 6.0, 6.0], [6.0, 6.0, 13.0], [6.0, 6.0, 9.5]]])
    with np.errstate(all="raise"):
        (found,) = pull_into(line, Room.of(allowed))
    assert keeps_to(found, allowed)
    assert (found[:, :2] == 6.0).all()


def test_one_that_just_fits_at_a_twentieth_of_its_size_is_kept():
    allowed = np.zeros((SIZE,) * 3, dtype=np.bool_)
    allowed[5:7, 5:7, 5:7] = True
    directions = np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    smallest = (15.0 / 16.0) ** 48
    for reach, kept in ((0.99 / smallest, True), (1.01 / smallest, False)):
        assert len(pull_into(6.0 + reach * directions[None], Room.of(allowed))) == kept
