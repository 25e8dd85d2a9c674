"""Which pieces of a mesh are closed, and what that proves of voxels."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.solid.closed_pieces import (
    closed_pieces,
    is_within,
    signatures,
    without_halls,
)
from simplifier.visibility.solid.spaces import voxels_of
from tests.solids import box, joined, torus
from tests.visibility.sheets import house, scene_of


def pieces(*meshes, floor=-1.0):
    mesh = joined(*meshes)
    return closed_pieces(np.array(mesh.vertices), np.array(mesh.faces), floor)


def test_boxes_are_pieces_and_an_open_one_is_none():
    found = pieces(box(), box(low=(3, 0, 0)), box(low=(6, 0, 0), without=(5,)))
    assert len(set(found[:12])) == 1
    assert len(set(found[12:24])) == 1
    assert found[0] != found[12]
    assert (found[:24] >= 0).all()
    assert (found[24:] == -1).all()


def test_an_open_base_is_closed_by_the_ground_and_a_crack_is_not():
    assert (pieces(box(without=(4,)), floor=0.0) >= 0).all()
    assert (pieces(box(without=(4,)), floor=-0.1) == -1).all()
    cracked = box(without=(4,))
    vertices = np.array(cracked.vertices)[cracked.faces].reshape(-1, 3)
    vertices[0, 2] += 1e-9
    assert (closed_pieces(vertices, np.arange(len(vertices)).reshape(-1, 3), 0.0) == -1).all()


@pytest.mark.parametrize("turned", [False, True])
def test_signatures_tell_inside_from_outside_and_pieces_apart(turned):
    ring = torus(4.0, 1.5)
    sheets = {
        "ring": TriangleMesh.from_soup(np.array(ring.vertices)[:, [0, 2, 1]] + 6.0, ring.faces)
    }
    sheets |= house("house", (20.0, 2.0, 0.0), (28.0, 10.0, 9.0))
    scene = scene_of(sheets)
    upright = UprightScene(scene, np.arange(3, dtype=np.int32), np.zeros(3), scene.bounds())
    voxels = voxels_of(upright, np.array([-1.0, -1.0, 0.0]), 0.5, (62, 40), 9.0, None)
    points = np.array(
        [[2.0, 6, 6], [10.1, 6, 6], [6, 6, 6], [1, 1, 1], [24, 6, 4], [21, 9, 1], [29, 6, 2]]
    )
    order = np.arange(7)[::-1] if turned else np.arange(7)
    found, closed = signatures(upright, voxels, voxels.place_of(points[order]))
    assert closed
    signs = np.empty(7, dtype=np.uint64)
    signs[order] = found
    assert signs[0] == signs[1] != 0
    assert signs[4] == signs[5] != 0
    assert signs[0] != signs[4]
    assert (signs[[2, 3, 6]] == 0).all()


def test_places_within_closed_pieces():
    """Beside, below and above them, on the diagonals of their faces, and in one that is open."""
    mesh = joined(box(), box(low=(3, 0, 0)), box(low=(6, 0, 0), without=(5,)))
    points, faces = np.array(mesh.vertices), np.array(mesh.faces)
    found = closed_pieces(points, faces, -1.0)
    places = [[0.5, 0.5, 0.5], [0.25, 0.75, 0.1], [3.4, 0.6, 0.9], [2.0, 0.5, 0.5],
              [0.5, 0.5, -0.5], [0.5, 0.5, 1.5], [6.5, 0.5, 0.5]]  # fmt: skip
    expected = [True, True, True, False, False, False, False]
    assert is_within(np.array(places), points, faces, found).tolist() == expected


def test_places_within_a_torus_are_those_of_its_formula():
    mesh = torus()
    points, faces = np.array(mesh.vertices), np.array(mesh.faces)
    places = np.random.default_rng(0).uniform(points.min(axis=0), points.max(axis=0), (300, 3))
    found = is_within(places, points, faces, closed_pieces(points, faces, -np.inf))
    assert 0.1 < found.mean() < 0.6
    corners = points[faces]
    towards = np.array([0.31, 0.17, 0.93])
    a, b, c = (corners[:, k] for k in range(3))
    for place, inside in zip(places, found, strict=True):  # along another line, by determinants
        whole = np.linalg.det(np.stack([a - b, a - c, np.broadcast_to(towards, a.shape)], axis=2))
        u = np.linalg.det(np.stack([a - place, a - c, np.broadcast_to(towards, a.shape)], axis=2))
        v = np.linalg.det(np.stack([a - b, a - place, np.broadcast_to(towards, a.shape)], axis=2))
        t = np.linalg.det(np.stack([a - b, a - c, a - place], axis=2))
        u, v, t = u / whole, v / whole, t / whole
        assert (np.count_nonzero((u > 0) & (v > 0) & (u + v < 1) & (t > 0)) % 2 == 1) == inside


@pytest.mark.parametrize(("share", "halls"), [(1.0, 1), (0.55, 1), (0.45, 0), (0.0, 0)])
def test_what_holds_half_of_a_cell_is_a_hall(share, halls):
    """One of two boxes, which a cell reaches into from the west; the other cells are outside."""
    mesh = joined(box((4.0, 4.0, 4.0)), box((4.0, 4.0, 4.0), (9.0, 0.0, 0.0)))
    points, faces = np.array(mesh.vertices), np.array(mesh.faces)
    closed = closed_pieces(points, faces, -1.0)
    low = np.array([[share - 1.0, 1.0, 1.0], [5.0, 1.0, 1.0], [20.0, 1.0, 1.0]])
    found = without_halls(points, faces, closed, ViewCells.boxes(low, low + 1.0))
    assert (found[12:] == closed[12:]).all()
    assert (found[:12] == (-1 if halls else closed[0])).all()


def test_a_shell_of_two_sheets_has_two_halls_where_viewers_are_in_both():
    """The sky around all of it is the third."""
    mesh = joined(box((4.0, 4.0, 4.0)), box((4.4, 4.4, 4.4), (-0.2, -0.2, -0.2)),
                  box((90.0, 90.0, 90.0), (-45.0, -45.0, -45.0)))  # fmt: skip
    points, faces = np.array(mesh.vertices), np.array(mesh.faces)
    closed = closed_pieces(points, faces, -np.inf)
    inside, outside = (
        ViewCells.boxes(np.array([low]), np.array([low]) + 1.0)
        for low in ([1.0, 1.0, 1.0], [9.0, 1.0, 1.0])
    )
    assert (without_halls(points, faces, closed, inside) == -1).all()
    assert len(np.unique(without_halls(points, faces, closed, outside))) == 3
