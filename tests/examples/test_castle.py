"""The castle is what it says: closed but for the ground, open where one looks through."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from examples.castle import castle


@pytest.fixture(scope="module")
def mesh():
    return castle()


def crossings(mesh, origin, direction):
    """Distances along a ray at which it crosses triangles, by Moeller and Trumbore, sorted."""
    origin, direction = np.asarray(origin, float), np.asarray(direction, float)
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    across = np.cross(direction, c - a)
    scale = np.einsum("ij,ij->i", b - a, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("ij,ij->i", origin - a, across) / scale
        turned = np.cross(origin - a, b - a)
        v = turned @ direction / scale
        t = np.einsum("ij,ij->i", c - a, turned) / scale
        hit = (np.abs(scale) > 1e-12) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    return np.sort(t[hit])


def test_size_and_place(mesh):
    assert 3_000 <= len(mesh.faces) <= 16_000
    assert mesh.dropped.total == 0
    low, high = mesh.bounds
    assert low[1] == 0.0
    assert 25.0 < high[1] < 40.0
    assert np.allclose(mesh.extent[[0, 2]], [80.0, 68.0], atol=1.0)


def test_same_bytes_on_every_call(mesh):
    again = castle()
    assert again.vertices.tobytes() == mesh.vertices.tobytes()
    assert again.faces.tobytes() == mesh.faces.tobytes()


def test_open_at_the_ground_and_nowhere_else(mesh):
    edges = Counter((int(f[i]), int(f[(i + 1) % 3])) for f in mesh.faces for i in range(3))
    alone = [edge for edge, count in edges.items() if count != edges[edge[::-1]]]
    assert len(alone) > 100
    assert (mesh.vertices[np.array(alone)][:, :, 1] == 0.0).all()


def test_every_piece_is_wound_outwards(mesh):
    """The flux of (0, y, 0) is the volume, and the missing faces at y = 0 carry none of it."""
    ends = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]]])
    links = coo_matrix((np.ones(len(ends)), ends.T), shape=(len(mesh.vertices),) * 2)
    count, piece = connected_components(links, directed=False)
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    flux = (a + b + c)[:, 1] / 3.0 * np.cross(b - a, c - a)[:, 1] / 2.0
    volumes = np.bincount(piece[mesh.faces[:, 0]], flux, count)
    assert count > 80
    assert (volumes > 0.05).all()


def test_one_can_look_through_the_gate_and_the_keep_s_door(mesh):
    hits = crossings(mesh, (0.13, 2.1, 80.0), (0.0, 0.0, -1.0))
    partition = 80.0 - (-6.0 + 0.25)
    assert hits[0] == pytest.approx(partition)


def test_the_curtain_is_as_thick_as_drawn(mesh):
    hits = crossings(mesh, (17.13, 1.3, 80.0), (0.0, 0.0, -1.0))
    assert 80.0 - hits[:2] == pytest.approx([29.2, 26.8])


def test_the_keep_s_windows_are_open_through_and_through(mesh):
    """In at a window on the west side, out at the one opposite."""
    hits = crossings(mesh, (-12.0, 8.3, -3.0), (1.0, 0.0, 0.0))
    assert (hits > 24.0).all()


def test_there_are_rooms_behind_the_windows(mesh):
    """From within one, below its windows: walls on all sides, the floor, and the ceiling."""
    room = (3.3, 7.0, -11.0)
    nearest = {
        axis: crossings(mesh, room, axis)[0]
        for axis in [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    }
    assert nearest[0, -1, 0] == pytest.approx(7.0 - 5.5)
    assert nearest[0, 1, 0] == pytest.approx(11.0 - 0.4 - 7.0)
    assert nearest[1, 0, 0] == pytest.approx(9.5 - 1.6 - 3.3)
    assert nearest[-1, 0, 0] == pytest.approx(3.3 + 2.5 - 0.25)
    assert nearest[0, 0, -1] == pytest.approx(13.5 - 1.6 - 11.0)
    assert nearest[0, 0, 1] == pytest.approx(11.0 - 6.0 - 0.25)
