"""Silhouettes by contours are those of triangles drawn one by one, to the bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import image_axes, random_directions
from simplifier.kernels import contours
from simplifier.kernels.contours import draw_by_contours, edge_table
from simplifier.kernels.coverage import by_contours, coverage_masks, draw_views, drawable
from tests import solids


def both(mesh, projections, rows, columns):
    """Masks by contours and triangle by triangle, and the table of edges."""
    points, faces, views = drawable(
        mesh.vertices, mesh.faces, projections, (2, rows, columns)
    )  # fmt: skip
    masks = [np.zeros((len(views), rows, -(-columns // 64)), np.uint64) for _ in range(2)]
    table = edge_table(points, faces)
    draw_by_contours(table, views, columns, masks[0])
    draw_views(points, faces, views, columns, 0, len(views), masks[1])
    return *masks, table


def looks(count, pixels, seed=0):
    """Views of the unit sphere, ``pixels`` across."""
    projections = np.empty((count, 2, 4))
    projections[:, :, :3] = image_axes(random_directions(count, seed))[:, :2] * (pixels / 2.0)
    projections[:, :, 3] = pixels / 2.0
    return projections


def without_shared_vertices(mesh):
    return solids.TriangleMesh(
        mesh.vertices[mesh.faces].reshape(-1, 3),
        np.arange(3 * len(mesh.faces), dtype=np.int32).reshape(-1, 3),
    )


def turned(mesh, some):
    faces = mesh.faces.copy()
    faces[some] = faces[some][:, ::-1]
    return solids.TriangleMesh(mesh.vertices, faces)


BALL, RING = solids.sphere(), solids.torus()
FORMS = {
    "closed but for rounding": (BALL, None),
    "closed, with a hole through it": (RING, 0),
    "in pieces that meet": (without_shared_vertices(RING), 0),
    "open": (solids.TriangleMesh(BALL.vertices, BALL.faces[40:]), None),
    "some triangles turned over": (turned(BALL, slice(0, None, 7)), None),
    "two that share an edge with two others": (
        solids.joined(solids.box(), solids.box(low=(1.0, 1.0, 0.0))), 0,
    ),
    "every triangle twice": (
        solids.TriangleMesh(BALL.vertices, np.concatenate([BALL.faces, BALL.faces])), None,
    ),
    "a soup": (solids.random_soup(3, 300, 0.2), None),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_the_same_pixels(name):
    mesh, unpaired = FORMS[name]
    found, expected, table = both(mesh, looks(70, 90), 90, 100)
    assert expected.any()
    np.testing.assert_array_equal(found, expected)
    assert (table.open == 0) == (unpaired == 0)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-3, 3)] * 3), min_size=4, max_size=12),
    st.lists(st.tuples(*[st.integers(0, 11)] * 3), min_size=1, max_size=40),
    st.sampled_from([1.0, 0.5, 1.0 / 3.0]),
)
def test_the_same_pixels_where_corners_lie_on_centres(places, triples, step):
    """Along an axis, with all ties that rounding can break; edges of any number of triangles."""
    points = np.array(places, dtype=np.float64)
    faces = np.array(triples, dtype=np.int32) % len(points)
    along = np.zeros((3, 2, 4))
    for view, (across, up) in enumerate([(0, 1), (1, 2), (2, 0)]):
        along[view, 0, across] = along[view, 1, up] = step
        along[view, :, 3] = 4.5
    found, expected, _ = both(solids.TriangleMesh(points, faces), along, 9, 9)
    np.testing.assert_array_equal(found, expected)


def test_the_same_pixels_beyond_the_picture():
    """Clipped on all sides, and so far away that rounding could take a crossing to another row."""
    far = solids.moved(RING, 1e6, 3e5)
    for mesh in (solids.moved(RING, 3.0, 0.4), far):
        found, expected, _ = both(mesh, looks(5, 64), 64, 64)
        np.testing.assert_array_equal(found, expected)


def test_any_number_of_views_at_a_time(monkeypatch):
    views = looks(9, 40)
    whole, expected, _ = both(RING, views, 40, 40)
    monkeypatch.setattr(contours, "views_at_a_time", lambda views: 2)
    pairs, _, _ = both(RING, views, 40, 40)
    np.testing.assert_array_equal(whole, expected)
    np.testing.assert_array_equal(pairs, expected)


def test_more_crossings_than_a_list_holds():
    """Bars so thin and many that a view's are counted one after the other."""
    steps = np.linspace(-0.9, 0.9, 160)
    bars = solids.joined(*[solids.box((0.006, 1.2, 0.006), (step, -0.6, 0.0)) for step in steps])
    views = looks(40, 640)
    views[7, 0, :3], views[7, 1, :3] = [318.0, 31.0, 0.0], [-31.0, 318.0, 0.0]
    found, expected, table = both(bars, views, 640, 640)
    np.testing.assert_array_equal(found, expected)
    assert table.open == 0
    edges = expected[7] ^ (expected[7] << np.uint64(1))
    assert np.bitwise_count(edges).sum() > contours._LISTED


def test_more_crossings_of_open_bars_than_a_list_holds(monkeypatch):
    """Of either list, with several views at a time and with one alone."""
    boxes = [solids.box((0.01, 1.2, 0.01), (step, -0.6, 0.0)) for step in np.linspace(-1, 1, 60)]
    bars = solids.joined(*[solids.TriangleMesh(one.vertices, one.faces[2:]) for one in boxes])
    monkeypatch.setattr(contours, "views_at_a_time", lambda views: 1 if views == 1 else 4)
    for count in (1, 6):
        views = looks(count, 1200)
        views[0, 0, :3], views[0, 1, :3] = [598.0, 58.0, 0.0], [-58.0, 598.0, 0.0]
        found, expected, table = both(bars, views, 1200, 1200)
        np.testing.assert_array_equal(found, expected)
        assert table.open > 0
        edges = expected[0] ^ (expected[0] << np.uint64(1))
        assert np.bitwise_count(edges).sum() > contours._LISTED


def test_the_order_of_triangles_and_vertices_does_not_matter():
    views, generator = looks(9, 40), np.random.default_rng(0)
    order, places = (
        generator.permutation(len(RING.faces)),
        generator.permutation(len(RING.vertices)),
    )
    shuffled = solids.TriangleMesh(
        RING.vertices[places], np.argsort(places).astype(np.int32)[RING.faces[order]]
    )
    found, expected, table = both(shuffled, views, 40, 40)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(table.vertices, both(RING, views, 40, 40)[2].vertices)


@pytest.mark.parametrize(
    ("faces", "views", "pixels", "expected"),
    [
        (4096, 32, 4096, True), (4096, 31, 4096, False),  # a pixel a triangle
        (65_536, 128, 4096, True), (65_536, 127, 4096, False),  # most lie between pixels
        (4096, 8, 65_536, True), (4096, 7, 65_536, False),  # all are drawn
        (4096, 10_000, 131_073, False), (1 << 22, 10_000, 1 << 22, False),  # at all
    ],
)  # fmt: skip
def test_views_that_a_table_of_edges_pays_for(faces, views, pixels, expected):
    assert by_contours(faces, views, pixels) == expected


@pytest.mark.parametrize(("faces", "expected"), [(1 << 21, True), (1 << 22, False), (127, False)])
def test_one_that_is_there_is_used_in_any_number_of_views(faces, expected):
    assert by_contours(faces, 1, 4096, there=True) == expected


def table_of(mesh):
    return edge_table(np.ascontiguousarray(mesh.vertices.T), mesh.faces)


def test_any_two_triangles_that_run_along_an_edge_in_opposite_directions_are_a_pair():
    """Fans around one edge: as many are left as run along it one way more often than the other."""
    fan = [(0, 1, 2), (1, 0, 3), (0, 1, 4), (0, 1, 5), (1, 0, 6)]
    points = np.random.default_rng(0).random((7, 3))
    for count in range(1, 6):
        for order in (fan[:count], fan[:count][::-1]):
            table = table_of(solids.TriangleMesh(points, np.array(order, dtype=np.int32)))
            forth = sum(face[0] == 0 for face in order)
            left = abs(2 * forth - count)
            assert table.open == 2 * count + left  # all other edges have one triangle
            assert len(table.edges) == 2 * count + left + (count - left) // 2
            edges = sorted(tuple(edge[2:]) for edge in table.edges[: (count - left) // 2])
            assert len({face for edge in edges for face in edge}) == 2 * len(edges)


def test_the_share_of_the_contour_is_that_of_random_views():
    for mesh in (solids.box(), BALL, RING):
        table = table_of(mesh)
        normals = table.planes[:, :3]
        facing = normals @ random_directions(4000, 0).T.astype(np.float32) > 0.0
        paired = table.edges[: len(table.edges) - table.open]
        shares = (facing[paired[:, 2]] != facing[paired[:, 3]]).mean()
        assert table.contour == pytest.approx(shares, abs=0.01)
    assert table_of(solids.box()).contour == pytest.approx(1.0 / 3.0)  # half of 12 edges of 18


@pytest.mark.parametrize(
    ("open_edges", "contour", "pixels", "expected"),
    [
        (0, 0.29, 100, True), (0, 0.31, 100, False),
        (2, 0.14, 100, True), (2, 0.16, 100, False),  # open ones are listed once, or twice
        (0, 0.16, 10, True), (0, 0.18, 10, False),  # most triangles lie between pixels
        (0, float("nan"), 100, False),  # areas are beyond float32
    ],
)  # fmt: skip
def test_edges_that_are_too_many_to_list(open_edges, contour, pixels, expected):
    table = contours.EdgeTable(
        np.zeros((9, 3)), np.zeros((100, 3), np.int32), np.zeros((100, 4), np.float32),
        np.zeros((20, 4), np.int32), open_edges, contour,
    )  # fmt: skip
    assert table.pays(pixels) == expected


def test_a_fine_mesh_in_many_views_is_drawn_by_its_contour(monkeypatch):
    views, drawn = looks(64, 40), []
    assert by_contours(len(BALL.faces), 64, 40 * 40)

    def draw(*arguments):
        drawn.append(arguments)
        draw_by_contours(*arguments)

    monkeypatch.setattr(contours, "draw_by_contours", draw)
    masks = coverage_masks(BALL.vertices, BALL.faces, views, 40, 40)
    assert len(drawn) == 1
    np.testing.assert_array_equal(masks, both(BALL, views, 40, 40)[1])
    soup = solids.random_soup(3, 900, 0.2)
    coverage_masks(soup.vertices, soup.faces, views, 40, 40)
    assert len(drawn) == 1  # most of its edges are open
