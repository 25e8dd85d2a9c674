"""A room: its limits, how far they reach, and the cells that have any of it."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.room import INTERIOR, NEVER, SURFACE, Room


def layered():
    """A row of cells of two voxels each: inside, surface, and three layers."""
    layers = np.full((12, 2, 2), NEVER, dtype=np.uint8)
    layers[:6] = np.arange(6)[:, None, None]
    blocks = layers.reshape(6, 2, 1, 2, 1, 2)
    least, most = blocks.min(axis=(1, 3, 5)), blocks.max(axis=(1, 3, 5))
    shares = np.zeros((6, 1, 1), dtype=np.uint8)
    return Room(layers, least, most, shares, 4, (0.0, 0.9, 1.4, 2.2, 2.7), 1.0, 0.5)


def test_it_reaches_no_further_than_asked_but_takes_in_the_surface():
    room = layered()
    assert [room.within(reach).limit for reach in (9.0, 2.7, 2.5, 1.4, 1.0, 0.0)] == [
        4, 4, 3, 2, SURFACE, SURFACE,
    ]  # fmt: skip
    assert room.up_to(2).within(9.0).limit == 2


def test_its_bound_is_its_reach_and_where_in_a_cell_the_surface_may_be():
    assert layered().bound == pytest.approx(3.2)
    assert Room.of(np.ones((2, 2, 2), np.bool_), 1.0, 3.4).bound == 3.4


def test_cells_with_any_room():
    room = layered()
    assert room.cells.ravel().tolist() == [True, True, True, False, False, False]
    assert room.up_to(INTERIOR).cells.ravel().tolist() == [True] + 5 * [False]
    allowed = np.random.default_rng(1).random((4, 5, 6)) < 0.5
    assert np.array_equal(Room.of(allowed).cells, allowed)
