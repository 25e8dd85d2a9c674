"""Faces outside go inwards; those inside, and those that nothing helps, stay."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.room import Room
from simplifier.kernels.voxelize import is_contained
from simplifier.refinement.decimate import sunk

FACE = np.array([[0, 1, 2]], dtype=np.int32)


def hollow():
    """A block with a groove along z in its upper side."""
    allowed = np.zeros((24, 24, 24), np.bool_)
    allowed[2:22, 2:22, 2:22] = True
    allowed[10:14, 17:] = False
    return Room.of(allowed)


def test_chord_across_a_groove_sinks_below_it():
    room = hollow()
    chord = np.array([[4.0, 19.0, 6.0], [20.0, 19.0, 6.0], [12.0, 19.0, 18.0]])
    assert not is_contained(*map(tuple, chord), room.voxels)
    moved = sunk(chord, FACE, room)
    assert is_contained(*map(tuple, moved), room.voxels)
    assert np.linalg.norm(moved - chord, axis=1).max() < 6.0
    # It keeps its size, where shrinking it would not.
    assert np.linalg.norm(moved[1] - moved[0]) > 12.0


def test_faces_inside_are_not_touched():
    room = hollow()
    points = np.array(
        [[4.0, 5.0, 6.0], [7.0, 5.0, 6.0], [4.0, 8.0, 8.0],
         [4.0, 19.0, 6.0], [20.0, 19.0, 6.0], [12.0, 19.0, 18.0]]
    )  # fmt: skip
    faces = np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32)
    assert np.array_equal(sunk(points, faces, room)[:3], points[:3])
    assert np.array_equal(sunk(points[:3], FACE, room), points[:3])


def test_what_nothing_helps_stays():
    nowhere = np.zeros((8, 8, 8), np.bool_)
    points = np.array([[1.0, 1.0, 1.0], [6.0, 1.0, 1.0], [1.0, 6.0, 1.0]])
    assert np.array_equal(sunk(points, FACE, Room.of(nowhere)), points)


def test_no_faces():
    points, faces = np.empty((0, 3)), np.empty((0, 3), np.int32)
    assert sunk(points, faces, hollow()).shape == (0, 3)
