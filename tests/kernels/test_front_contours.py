"""Fronts by contours are those of triangles drawn one by one, to the pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import image_axes, random_directions
from simplifier.kernels import front, front_contours
from simplifier.kernels.contours import draw_by_contours, edge_table
from simplifier.kernels.coverage import draw_views, drawable
from simplifier.kernels.front import count_front, front_pixels
from simplifier.kernels.front_contours import count_front_by_contours
from tests import solids
from tests.kernels.test_contours import BALL, FORMS, RING, without_shared_vertices

HALF = solids.moved(solids.sphere(rings=5), 0.8)


def looks(count, pixels, seed=0):
    """Views of the unit sphere, ``pixels`` across, with depths."""
    projections = np.zeros((count, 3, 4))
    projections[:, :, :3] = image_axes(random_directions(count, seed))
    projections[:, :2] *= pixels / 2.0
    projections[:, :2, 3] = pixels / 2.0
    return projections


def both(mesh, occluder, projections, image, threshold=0.02):
    """Pixels by contours and triangle by triangle."""
    points, faces, views = drawable(mesh.vertices, mesh.faces, projections, (3, image, image))
    others = drawable(occluder.vertices, occluder.faces, projections, (3, image, image))[:2]
    table, flat = edge_table(points, faces), np.ascontiguousarray(views[:, :2])
    shown = np.zeros((2, len(views), image, -(-image // 64)), np.uint64)
    draw_by_contours(table, flat, image, shown[0])
    draw_views(points, faces, flat, image, 0, len(views), shown[1])
    pixels = np.zeros((2, len(views), 2), np.int64)
    count_front_by_contours(table, shown[0], others, views, image, threshold, pixels[0])
    count_front(points, faces, False, *others, views, threshold, 0, len(views), shown[1], pixels[1])
    return pixels


OCCLUDERS = {
    "within": HALF,
    "around": solids.moved(solids.sphere(rings=5), 1.1),
    "through it": solids.moved(solids.box(), 1.1, (-0.2, -0.4, -0.6)),
    "a soup": solids.random_soup(5, 40, 0.4),
    "itself": BALL,
}


@pytest.mark.parametrize("other", OCCLUDERS)
@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("threshold", [0.02, -0.3])
def test_the_same_pixels(name, other, threshold):
    found, expected = both(FORMS[name][0], OCCLUDERS[other], looks(70, 90), 90, threshold)
    np.testing.assert_array_equal(found, expected)
    assert expected[:, 0].all()


def test_there_is_a_front_to_find():
    """In what the others compare: much, little and none."""
    shares = [both(RING, OCCLUDERS[other], looks(9, 90), 90)[1].sum(axis=0) for other in OCCLUDERS]
    assert [bool(before) for _, before in shares] == [True] * 5
    assert both(BALL, HALF, looks(9, 90), 90)[1][:, 1].sum() == 0


@pytest.mark.parametrize("image", [9, 64, 150, 400])
def test_triangles_of_all_sizes(image):
    """From less than a pixel to more than a block's."""
    for rings in (4, 9, 40):
        mesh = solids.moved(solids.blob(3, rings), 0.8)
        found, expected = both(mesh, HALF, looks(4, image), image)
        np.testing.assert_array_equal(found, expected)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-3, 3)] * 3), min_size=4, max_size=12),
    st.lists(st.tuples(*[st.integers(0, 11)] * 3), min_size=1, max_size=40),
    st.lists(st.tuples(*[st.integers(0, 11)] * 3), min_size=1, max_size=6),
    st.sampled_from([1.0, 0.5, 1.0 / 3.0]),
    st.sampled_from([0.0, 1.0, -1.0, 0.3]),
)
def test_the_same_pixels_where_corners_lie_on_centres(places, triples, others, step, threshold):
    """Along an axis, with all ties that rounding can break, also those of depth and limit."""
    points = np.array(places, dtype=np.float64)
    mesh, occluder = (
        solids.TriangleMesh(points, np.array(some, dtype=np.int32) % len(points))
        for some in (triples, others)
    )
    along = np.zeros((3, 3, 4))
    for view, axes in enumerate([(0, 1, 2), (1, 2, 0), (2, 0, 1)]):
        for row, axis in enumerate(axes):
            along[view, row, axis] = step if row < 2 else 1.0
        along[view, :2, 3] = 4.5
    found, expected = both(mesh, occluder, along, 9, threshold)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e6, 1e40])
def test_depths_of_any_size(scale):
    """Also far from the origin of depth, where steps are larger than what rounding leaves."""
    views = looks(6, 64)
    views[:, 2] *= scale
    for away in (0.0, 1.0, 1e9):
        views[:, 2, 3] = away * scale
        found, expected = both(RING, OCCLUDERS["through it"], views, 64, 0.02 * scale)
        np.testing.assert_array_equal(found, expected)


def test_a_flat_mesh_and_one_that_is_a_point():
    flat = solids.TriangleMesh(BALL.vertices * [1.0, 1.0, 0.0], BALL.faces)
    point = solids.TriangleMesh(BALL.vertices * 0.0, BALL.faces)
    along = np.concatenate([np.eye(3, 4)[None] * [[32.0], [32.0], [1.0]], looks(3, 64)])
    along[:, :2, 3] = 32.0
    for mesh in (flat, point):
        for occluder in (HALF, solids.moved(BALL, 1.0, (0.0, 0.0, -2.0)), solids.NOTHING):
            found, expected = both(mesh, occluder, along, 64)
            np.testing.assert_array_equal(found, expected)


def test_beyond_the_picture_and_with_far_occluders():
    far = solids.moved(RING, 1e6, 3e5)
    for mesh in (solids.moved(RING, 3.0, 0.4), far):
        for occluder in (RING, far, solids.moved(BALL, 1e30, 1e29)):
            found, expected = both(mesh, occluder, looks(5, 64), 64)
            np.testing.assert_array_equal(found, expected)


def test_the_side_that_faces_the_viewer_is_drawn_first(monkeypatch):
    """Of a solid the one that is wound forwards, wherever it lies; of a sheet either."""
    chosen = []
    monkeypatch.setattr(
        front_contours, "count_fronts", lambda *arguments: chosen.append(arguments[7])
    )
    sheet = solids.box(without=(0, 1, 2, 3, 4))
    down = np.eye(3, 4)[None] * [[32.0], [32.0], [1.0]]
    up = down * [[[1.0], [-1.0], [-1.0]]]
    for mesh in (solids.moved(BALL, 0.5, (3.0, 1.0, 2.0)), RING):
        both(mesh, HALF, looks(5, 64), 64)
        forwards = chosen[-1]  # of as many calls as there are threads
        both(solids.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]), HALF, looks(5, 64), 64)
        assert (forwards != chosen[-1]).all()
        assert len(set(forwards)) == 1
    both(sheet, HALF, np.concatenate([down, up]), 64)
    assert list(chosen[-1]) == [False, True]


def test_any_number_of_views_at_a_time(monkeypatch):
    views = looks(40, 40)
    whole, expected = both(RING, HALF, views, 40)
    monkeypatch.setattr(front_contours, "views_at_a_time", lambda views: 3)
    parts, _ = both(RING, HALF, views, 40)
    np.testing.assert_array_equal(whole, expected)
    np.testing.assert_array_equal(parts, expected)


def test_a_fine_mesh_in_many_views_is_counted_so(monkeypatch):
    views, counted = looks(64, 40), []
    monkeypatch.setattr(front, "LEAST_FACES", len(RING.faces))

    def count(*arguments):
        counted.append(arguments)
        count_front_by_contours(*arguments)

    monkeypatch.setattr(front_contours, "count_front_by_contours", count)
    mesh, occluder = without_shared_vertices(RING), OCCLUDERS["a soup"]
    for one in (mesh, solids.random_soup(3, 900, 0.2)):
        found = front_pixels(
            (one.vertices, one.faces), (occluder.vertices, occluder.faces), views, 40, 0.02
        )
        np.testing.assert_array_equal(found, both(one, occluder, views, 40)[1])
        assert len(counted) == 1  # most of the soup's edges are open
    monkeypatch.setattr(front, "LEAST_FACES", len(RING.faces) + 1)
    assert np.array_equal(
        front_pixels((mesh.vertices, mesh.faces), (HALF.vertices, HALF.faces), views, 40, 0.02),
        both(mesh, HALF, views, 40)[1],
    )
    assert len(counted) == 1
