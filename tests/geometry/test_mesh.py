"""TriangleMesh: what is dropped, what is refused, and that nothing can be changed later."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simplifier.errors import EmptyMeshError
from simplifier.geometry.mesh import DroppedTriangles, Reach, TriangleMesh, have_area

SPHERE = np.arange(300).reshape(-1, 3)  # faces of the points below
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
NAN, INF = float("nan"), float("inf")


def sphere_points():
    """(300, 3) corners of 100 triangles strewn over the unit sphere."""
    points = np.random.default_rng(1).normal(size=(300, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def box_arrays():
    """The unit cube, two triangles a side; six of them meet in corner 0."""
    corners = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64)
    quads = [[0, 1, 3, 2], [0, 4, 5, 1], [0, 2, 6, 4], [7, 3, 1, 5], [7, 5, 4, 6], [7, 6, 2, 3]]
    return corners, np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])


def test_copies_and_freezes():
    vertices, faces = np.array(SQUARE, dtype=np.float64), np.array([[0, 1, 2]], dtype=np.int32)
    mesh = TriangleMesh.from_soup(vertices, faces)
    vertices[:], faces[:] = 9.0, 3
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2]]
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1
    with pytest.raises(AttributeError):
        mesh.vertices = vertices


@pytest.mark.parametrize("number", [np.float32, np.float64, np.int16, np.uint8, int])
@pytest.mark.parametrize("index", [np.uint16, np.int64, np.uint32, int])
def test_any_real_dtype(number, index):
    mesh = TriangleMesh.from_soup(np.array(SQUARE, number), np.array([[0, 1, 2]], index))
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int32
    assert mesh.faces.flags.c_contiguous


def test_lists_and_other_orders():
    mesh = TriangleMesh.from_soup(np.asfortranarray(SQUARE), [[0, 1, 2], [0, 2, 3]])
    assert mesh.vertices.flags.c_contiguous
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_unused_vertices_go():
    stray = [*SQUARE[:1], [1e9, 1e9, 1e9], *SQUARE[1:], [NAN, 0, 0]]
    mesh = TriangleMesh.from_soup(stray, [[0, 2, 3], [0, 3, 4]])
    assert mesh.vertices.tolist() == SQUARE
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.dropped == DroppedTriangles()


@pytest.mark.parametrize("value", [NAN, INF, -INF, 1e100, -1e300])
@pytest.mark.parametrize("place", [(0, 0), (1, 1), (2, 2)])
def test_non_finite_triangles_are_counted(value, place):
    vertices = np.array([*SQUARE, *SQUARE], dtype=np.float64)
    vertices[place] = value
    mesh = TriangleMesh.from_soup(vertices, [[0, 1, 2], [4, 5, 6]])
    assert mesh.dropped == DroppedTriangles(non_finite=1)
    assert len(mesh.faces) == 1


@pytest.mark.parametrize("face", [[0, 0, 1], [0, 1, 0], [1, 0, 0], [2, 2, 2]])
def test_repeated_indices_are_counted(face):
    mesh = TriangleMesh.from_soup(SQUARE, [face, [0, 1, 2]])
    assert mesh.dropped == DroppedTriangles(repeated_index=1)


@pytest.mark.parametrize("scale", [1e-140, 1e-30, 1.0, 1e30, 1e99])
@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0, 0], [1, 1, 1], [2, 2, 2]],
        [[0, 0, 0], [0, 0, 0], [1, 0, 0]],
        [[1, 2, 3], [1, 2, 3], [1, 2, 3]],
        [[0, 0, 0], [2, 0, 0], [1, 0, 0]],
    ],
)
def test_triangles_without_area_are_counted(corners, scale):
    vertices = np.array([*SQUARE, *corners]) * scale
    mesh = TriangleMesh.from_soup(vertices, [[0, 1, 2], [4, 5, 6]])
    assert mesh.dropped == DroppedTriangles(zero_area=1)
    assert mesh.vertices == pytest.approx(np.array(SQUARE[:3]) * scale, abs=0.0)


@given(
    arrays(
        np.float64, st.tuples(st.integers(0, 20), st.just(3), st.just(3)),
        elements=st.sampled_from([0.0, 1.0, 2.0, 3.0, -1.0, 1e-300, 5e-324, 1e99, -1e99, 1 / 3]),
    )
)  # fmt: skip
def test_area_one_triangle_at_a_time(triangles):
    def has_area(triangle):
        u, v = triangle[1:] - triangle[0]
        scale = max(abs(u).max(), abs(v).max()) or 1.0
        return bool(np.cross(u / scale, v / scale).any())

    assert have_area(triangles).tolist() == [has_area(triangle) for triangle in triangles]


def test_a_bad_triangle_of_very_many_is_found():
    points = np.random.default_rng(2).normal(size=(1000, 3))
    faces = np.arange(40_000)[:, None] % 997 + np.arange(3)
    points[999] = NAN
    faces[20_000], faces[30_000] = [0, 1, 1], [0, 1, 999]
    mesh = TriangleMesh.from_soup(points, faces)
    assert mesh.dropped == DroppedTriangles(
        non_finite=1, repeated_index=1, first={"non_finite": 30_000, "repeated_index": 20_000}
    )
    np.testing.assert_array_equal(mesh.faces, np.delete(faces, [20_000, 30_000], axis=0))


@pytest.mark.parametrize("height", [1e-12, 1e-100])
def test_slivers_stay(height):
    mesh = TriangleMesh.from_soup([[0, 0, 0], [1, 0, 0], [0.5, height, 0]], [[0, 1, 2]])
    assert mesh.dropped.total == 0


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, (6, 3), elements=st.floats(-2, 2) | st.sampled_from([NAN, INF, 0.0])),
    arrays(np.int64, (8, 3), elements=st.integers(0, 5)),
)
def test_every_triangle_is_kept_or_counted(vertices, faces):
    try:
        mesh = TriangleMesh.from_soup(vertices, faces)
    except EmptyMeshError:
        return
    assert len(mesh.faces) + mesh.dropped.total == len(faces)
    assert np.isfinite(mesh.vertices).all()
    corners = [vertices[face].tolist() for face in faces]
    assert all(triangle.tolist() in corners for triangle in mesh.vertices[mesh.faces])
    assert len(np.unique(mesh.faces)) == len(mesh.vertices)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [([], []), (SQUARE, []), (np.empty((0, 3)), np.empty((0, 3), int)), ([], [[0, 1, 2]])],
)
def test_no_triangle_at_all(vertices, faces):
    with pytest.raises(EmptyMeshError, match=r"^scene\.obj: the mesh has no triangle; export"):
        TriangleMesh.from_soup(vertices, faces, where="scene.obj")


def test_none_left():
    with pytest.raises(EmptyMeshError, match="none of the 2 triangles has a finite, non-zero area"):
        TriangleMesh.from_soup([*SQUARE, [NAN, 0, 0]], [[0, 1, 1], [0, 1, 4]])


def test_bounds_and_extent():
    mesh = TriangleMesh.from_soup([[1, -2, 3], [4, 5, -6], [0, 0, 0]], [[0, 1, 2]])
    assert mesh.bounds.tolist() == [[0, -2, -6], [4, 5, 3]]
    assert mesh.extent.tolist() == [4, 7, 9]


@pytest.mark.parametrize("far", [1e9, 1e30, -1e99])
@pytest.mark.parametrize("offset", [0.0, 5e6])
def test_triangles_beyond_all_sense_are_counted(far, offset):
    """A vertex at 1e30 once stretched the grid until the rest was one voxel: no occluder at all."""
    vertices = np.concatenate([sphere_points(), [[0.0, far, 0.0]]]) + offset
    faces = [*SPHERE.tolist(), [0, 1, len(vertices) - 1], [0, 2, len(vertices) - 1]]
    mesh = TriangleMesh.from_soup(vertices, faces)
    assert mesh.dropped == DroppedTriangles(far_away=2)
    assert mesh.dropped.first == {"far_away": len(SPHERE)}
    assert mesh.extent.max() <= 2.0


def test_a_cube_with_one_corner_at_the_end_of_the_world():
    """Half of the triangles meet there; of most the area is lost to rounding."""
    vertices, faces = box_arrays()
    vertices[0] = 1e30
    assert (faces == 0).any(axis=1).sum() == 6
    mesh = TriangleMesh.from_soup(vertices, faces)
    assert mesh.dropped.total == len(mesh.faces) == 6
    assert mesh.vertices.max() == 1.0


@pytest.mark.parametrize("ratio", [1e3, 1e6])
def test_what_a_scene_may_hold_is_kept(ratio):
    """A statue on a plain, and a plain of few triangles around much detail."""
    plain = np.array(SQUARE) * ratio - 0.5 * ratio
    vertices = np.concatenate([sphere_points(), plain])
    first = len(vertices) - 4
    mesh = TriangleMesh.from_soup(
        vertices, [*SPHERE.tolist(), [first, first + 1, first + 2], [first, first + 2, first + 3]]
    )
    assert mesh.dropped.total == 0


def test_needles_from_one_point_are_kept():
    """Two corners of each are next to each other: most vertices lie at the middle."""
    tips = np.random.default_rng(0).normal(size=(30, 3))
    vertices = np.concatenate(
        [[tip, [1e-12, 0, 0], [0, 1e-12 * k, 0]] for k, tip in enumerate(tips, 1)]
    )
    mesh = TriangleMesh.from_soup(vertices, np.arange(90).reshape(-1, 3))
    assert mesh.dropped.total == 0


@pytest.mark.parametrize("count", [3, 4, 57, 300])
def test_the_middle_is_the_median(count):
    points = sphere_points()[:count] * [1.0, 1e-9, 1e12]
    middle = Reach.measure(points, SPHERE[: count // 3]).middle
    assert np.array_equal(middle, np.median(points, axis=0))


@pytest.mark.parametrize("far", [None, 1e20])
def test_the_usual_reach_is_that_of_the_triangles_that_are_kept(far):
    points = sphere_points()
    if far is not None:
        points[0, 1] = far
    mesh = TriangleMesh.from_soup(points, SPHERE)
    assert (mesh.dropped.far_away > 0) == (far is not None)
    assert mesh.usual_reach == Reach.measure(mesh.vertices, mesh.faces).usual


def test_counts_add_up():
    total = DroppedTriangles(1, 2, 3, 4) + DroppedTriangles(10, 20, 30, 40)
    assert total == DroppedTriangles(11, 22, 33, 44)
    assert total.total == 110


def test_what_was_dropped_in_words():
    dropped = DroppedTriangles(non_finite=2, far_away=1, first={"non_finite": 7})
    assert str(dropped) == (
        "2 not finite (the first is triangle 7), 1 over 2e+07 times as far out as half of the mesh"
    )


def test_the_first_of_each_kind_is_named():
    faces = [[0, 1, 2], [0, 1, 1], [0, 2, 3], [2, 2, 2], [0, 1, 4]]
    mesh = TriangleMesh.from_soup([*SQUARE, [NAN, 0, 0]], faces)
    assert mesh.dropped.first == {"repeated_index": 1, "non_finite": 4}
