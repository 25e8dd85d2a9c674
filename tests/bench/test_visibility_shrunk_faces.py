"""Occluders shrunk by faces that move and by an eroded grid hide less than there is, never more."""

from __future__ import annotations

import numpy as np
import pytest

from bench.shrunk_face_kernels import Boxed, blocked_by_voxels, blocked_lines
from bench.visibility_shrunk_faces import Rooms, by_moved_faces, edge_rows, moved_faces, seen_points
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options.visibility import PvsOptions
from tests.solids import box, random_soup, sphere
from tests.visibility.rooms import scene_of, two_rooms
from tests.visibility.sheets import quad
from tests.visibility.sheets import scene_of as scene_of_sheets


def triangles_of(mesh):
    return np.array(mesh.vertices)[mesh.faces]


def test_the_faces_of_a_box_move_to_a_smaller_one():
    moved = moved_faces(triangles_of(box((2.0, 3.0, 4.0))), 0.25)
    assert len(moved) == 12
    inner = triangles_of(box((1.5, 2.5, 3.5), (0.25, 0.25, 0.25)))
    assert np.sort(moved.ravel()) == pytest.approx(np.sort(inner.ravel()))


@pytest.mark.parametrize(("thickness", "count"), [(0.52, 12), (0.48, 0)])
def test_faces_whose_paths_meet_are_dropped(thickness, count):
    """A slab must be thicker than twice what its faces move."""
    assert len(moved_faces(triangles_of(box((5.0, 5.0, thickness))), 0.25)) == count


def test_what_is_smaller_than_the_move_turns_inside_out_where_all_faces_share_corners():
    """As published: nothing is dropped, and what is left lies outside of the tetrahedron."""
    corners = np.eye(4)[:, :3]
    faces = corners[np.array([[3, 1, 0], [3, 0, 2], [0, 1, 2], [3, 2, 1]])]
    assert moved_faces(faces, 0.1).min() == pytest.approx(0.1)
    moved = moved_faces(faces, 0.3)
    assert len(moved) == 4
    assert moved.min() < -0.2


def test_faces_move_by_the_distance_at_least():
    moved = moved_faces(triangles_of(sphere(2.0)), 0.3)
    assert len(moved) > 400
    assert np.linalg.norm(moved, axis=2).max() <= 1.7


def test_lines_are_blocked_as_by_each_triangle_alone():
    triangles = triangles_of(random_soup(1, 60, 0.3))
    points = np.random.default_rng(2).random((300, 3))
    eye = np.array([-1.0, 0.4, 0.6])
    boxed, found = Boxed.of(triangles), np.zeros(300, dtype=bool)
    blocked_lines(eye, points, boxed.boxes, boxed.triangles, found)
    a, b, c = triangles.swapaxes(0, 1)[:, :, None]
    towards = np.broadcast_to(points - eye, (60, 300, 3))
    sides = np.stack(np.broadcast_arrays(b - a, c - a, -towards), axis=-1)
    u, v, t = np.linalg.solve(sides, (eye - a + 0.0 * towards)[..., None])[..., 0].transpose(
        2, 0, 1
    )
    expected = ((u > 0) & (v > 0) & (u + v < 1) & (t > 0) & (t < 1)).any(axis=0)
    assert 30 < expected.sum() < 270
    assert (found == expected).all()


def test_lines_are_blocked_by_a_voxel_on_the_way():
    solid = np.zeros((9, 9, 9), dtype=bool)
    solid[4, 4, 4] = True
    points = np.array([[8.5, 4.5, 4.5], [8.5, 8.5, 4.5], [3.5, 4.5, 4.5]])
    found = np.zeros(3, dtype=bool)
    blocked_by_voxels(np.array([0.5, 4.5, 4.5]), points, solid, found)
    assert found.tolist() == [True, False, False]


def test_in_rooms_no_way_leaks_and_the_grid_keeps_more_of_walls_that_touch():
    rooms = Rooms.of(UprightScene.of(scene_of(two_rooms(0.0)), "z"), 40)
    eye = np.array([[1.5, 2.5, 2.0]]) + np.array([0.5, 0.5, 0.0])
    options = PvsOptions(up="z", method="slice-wise", epsilon=0.5)
    rows = {row["way"]: row for row in edge_rows("rooms", rooms, eye, 0.2, options)}
    assert list(rows) == ["published", "closed", "grid", "shafts"]
    assert not any(row["leaks"] for row in rows.values())
    assert rows["shafts"]["visible"] <= rows["grid"]["visible"] <= rows["closed"]["visible"]
    assert rows["closed"]["visible"] < len(two_rooms())
    assert rows["grid"]["slices_hidden"] >= rows["closed"]["slices_hidden"] > 0.0


def test_an_open_sheet_that_is_moved_hides_what_is_seen_past_it():
    """It moves towards the eye; closed pieces alone hide nothing there."""
    screen = quad((2.0, -1.0, -1.0), (2.0, -1.0, 1.0), (2.0, 1.0, 1.0), (2.0, 1.0, -1.0))
    turned = TriangleMesh.from_soup(screen.vertices, screen.faces[:, ::-1])
    lamp = box((0.1, 0.1, 0.1), (4.0, 2.2, 0.0))
    scene = scene_of_sheets({"screen": turned, "lamp": lamp})
    rooms = Rooms.of(UprightScene.of(scene, "z"), 40)
    eye, of_lamp = -rooms.upright.origin, rooms.owners == 1
    published, _ = by_moved_faces(rooms, 0.5, closed=False)
    closed, left = by_moved_faces(rooms, 0.5, closed=True)
    # The lamp hides its own far sides in neither.
    assert (published(eye, rooms.points[of_lamp])).all()
    assert not closed(eye, rooms.points[of_lamp]).any()
    assert left["left"] == 0.0
    assert seen_points(rooms, eye, 0.5)[of_lamp].any()
