"""Edges that are listed eight at once cross the rows that they cross in Python."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.kernels.compiled.kernel import inner_kernel
from simplifier.kernels.contours import list_eight

NO_ROOM = 1 << 33


@inner_kernel
def listed_by_machine(vertices, edges, some, begin, left, view, turned, crossings, room, used):
    return list_eight(vertices, edges, some, begin, left, view, turned, crossings, room, used)


def edges_of(rng, length, columns, rows):
    """Vertices (n, 3), and 40 edges (e, 4) of about that length, some level, some on centres."""
    begins = rng.uniform([-4, -4, 0], [columns + 4, rows + 4, 1], (40, 3))
    ends = begins + rng.normal(0.0, length, (40, 3))
    level = rng.random(40) < 0.2
    ends[level, 1] = begins[level, 1]
    vertices = np.concatenate([begins, ends])
    on_centre = rng.random(80) < 0.05
    vertices[on_centre] = np.round(vertices[on_centre]) + 0.5
    edges = rng.integers(0, 99, (40, 4)).astype(np.int32)
    edges[:, 0], edges[:, 1] = np.arange(40), np.arange(40, 80)
    return vertices, edges


@pytest.mark.parametrize("turned", [0, 1])
@pytest.mark.parametrize("length", [0.3, 3.0, 30.0])
def test_eight_edges_cross_as_in_python(length, turned):
    rng, columns, rows = np.random.default_rng(int(10 * length)), 90, 70
    unsure, lengths = set(), set()
    # The plane is turned a little, so that all three coordinates count.
    view = np.array([1.0, 0.1, -0.2, -0.5, 0.05, 1.0, 0.3, -0.5, columns, rows])
    for _ in range(20):
        vertices, edges = edges_of(rng, length, columns, rows)
        if rng.random() < 0.5:
            view[[1, 2, 4, 6]] = 0.0
        some = np.arange(40, dtype=np.int32)
        some[rng.random(40) < 0.5] ^= -1
        for begin, left in ((0, 40), (8, 8), (24, 3), (32, 1)):
            found, told = np.full((2, 3000), -7, np.int32)
            given = vertices, edges, some, begin, left, view, turned
            result = int(listed_by_machine(*given, found, len(found), 5))
            assert result == list_eight(*given, told, len(told), 5)
            count = result & 0xFFFFFFFF
            # What counts in a view is summed up, so in which order it is listed does not matter.
            assert np.array_equal(np.sort(found[:count]), np.sort(told[:count]))
            assert (found[count + 8 :] == -7).all()
            unsure.add(result >> 32)
            lengths.add(count - 5)
    assert unsure == {0, 1}
    assert len(lengths) > 3


def test_nothing_is_listed_where_there_is_not_room_for_all():
    rng = np.random.default_rng(3)
    vertices, edges = edges_of(rng, 30.0, 90, 70)
    some, view = np.arange(40, dtype=np.int32), np.array([1.0, 0, 0, 0, 0, 1.0, 0, 0, 90, 70])
    told = np.empty(3000, np.int32)
    count = int(list_eight(vertices, edges, some, 0, 8, view, 0, told, 3000, 0)) & 0xFFFFFFFF
    assert count > 50
    for room, expected in ((count + 8, count), (count + 7, NO_ROOM)):
        found = np.full(3000, -7, np.int32)
        for tell in (list_eight, listed_by_machine):
            result = int(tell(vertices, edges, some, 0, 8, view, 0, found, room, 0))
            assert result & ~(1 << 32) == expected
            assert (found[room:] == -7).all()
            assert (expected == NO_ROOM) == (found == -7).all()
            found[:] = -7
