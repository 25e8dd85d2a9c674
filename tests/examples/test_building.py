"""Parts are closed, wound outwards, and as large as the drawing says."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon
from shapely.geometry import box as rectangle

from examples.building import (
    Opening,
    battlements,
    box,
    prism,
    revolved,
    room,
    slab,
    tube,
    wall,
)
from examples.part import Part, joined, triangulated


def open_edges(part: Part) -> list[tuple[int, int]]:
    """Directed edges that are not run along as often the other way."""
    edges = Counter((int(face[i]), int(face[(i + 1) % 3])) for face in part.faces for i in range(3))
    return [edge for edge, count in edges.items() if count != edges[edge[::-1]]]


def volume(part: Part) -> float:
    a, b, c = part.vertices[part.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def regular_area(radius: float, sides: int) -> float:
    return sides / 2.0 * radius**2 * np.sin(2.0 * np.pi / sides)


@st.composite
def walls_with_windows(draw):
    """A star-shaped outline (any slopes) with rectangular holes on a grid inside it."""
    count = draw(st.integers(4, 12))
    radii = draw(st.lists(st.floats(6.0, 9.0), min_size=count, max_size=count))
    turn = np.arange(count) * (2.0 * np.pi / count) + draw(st.floats(0.0, 1.0))
    outline = np.stack([radii * np.cos(turn), radii * np.sin(turn)], axis=1)
    cells = draw(st.sets(st.tuples(st.integers(-2, 1), st.integers(-2, 1)), max_size=6))
    holes = [np.array(rectangle(i, j, i + 0.6, j + 0.7).exterior.coords[:-1]) for i, j in cells]
    return [outline, *holes]


@settings(max_examples=80, deadline=None)
@given(walls_with_windows())
def test_triangulation_covers_the_shape_once_without_t_junctions(rings):
    points, triangles = triangulated(rings)
    corners = points[triangles]
    edge = corners[:, 1:] - corners[:, :1]
    areas = 0.5 * (edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])
    assert (areas > 0.0).all()
    expected = Polygon(np.round(rings[0], 4), [np.round(ring, 4) for ring in rings[1:]]).area
    assert areas.sum() == pytest.approx(expected, rel=1e-9)
    assert not points_within_edges(points, triangles)


def points_within_edges(points, triangles):
    """Plain search over all upright edges: only there can triangles of two columns meet."""
    return [
        (a, b, p)
        for face in triangles.tolist()
        for a, b in zip(face, face[1:] + face[:1], strict=True)
        if points[a, 0] == points[b, 0]
        for p in range(len(points))
        if points[p, 0] == points[a, 0]
        and min(points[a, 1], points[b, 1]) < points[p, 1] < max(points[a, 1], points[b, 1])
    ]


@settings(max_examples=60, deadline=None)
@given(walls_with_windows(), st.floats(0.1, 5.0))
def test_prism_is_closed_and_has_area_times_depth(rings, depth):
    part = prism(rings, depth)
    assert open_edges(part) == []
    expected = Polygon(np.round(rings[0], 4), [np.round(ring, 4) for ring in rings[1:]]).area
    assert volume(part) == pytest.approx(expected * depth, rel=1e-9)


def test_wall_loses_the_volume_of_its_openings():
    openings = [Opening(-2.0, 0.0, 1.0, 2.0), Opening(2.0, 1.0, 0.5, 1.0)]
    part = wall(10.0, 4.0, 0.5, openings)
    assert open_edges(part) == []
    assert volume(part) == pytest.approx((10.0 * 4.0 - 2.0 - 0.5) * 0.5, rel=1e-12)


@pytest.mark.parametrize(("width", "edges"), [(1.0, 4), (3.0, 8)])
def test_arched_door_takes_a_rectangle_and_half_a_regular_polygon(width, edges):
    part = wall(10.0, 6.0, 1.0, [Opening(0.0, 0.0, width, 4.0, arched=True)])
    assert open_edges(part) == []
    hole = width * (4.0 - width / 2.0) + regular_area(width / 2.0, 2 * edges) / 2.0
    assert volume(part) == pytest.approx(60.0 - hole, abs=1e-3)


def test_battlements_add_half_of_a_metre_high_strip():
    part = wall(12.0, 2.0, 1.0, (), battlements(12.0, 2.0, 5))
    assert open_edges(part) == []
    assert volume(part) == pytest.approx(12.0 * 2.0 + 6.0 * 1.0, rel=1e-4)
    assert part.vertices[:, 1].max() == 3.0


@pytest.mark.parametrize("sides", [3, 8, 24])
def test_tube_is_the_difference_of_two_regular_prisms(sides):
    part = tube(5.0, 7.0, 1.0, sides)
    assert open_edges(part) == []
    expected = 7.0 * (regular_area(5.0, sides) - regular_area(4.0, sides))
    assert volume(part) == pytest.approx(expected, rel=1e-4)


def test_tube_with_openings_and_merlons_is_closed_and_its_window_faces_its_angle():
    part = tube(5.0, 7.0, 1.0, 16, [Opening(90.0, 3.0, 1.0, 1.5, arched=True)], merlons=8)
    assert open_edges(part) == []
    solid = tube(5.0, 7.0, 1.0, 16, merlons=8)
    assert volume(part) < volume(solid)
    extra = {tuple(p) for p in np.round(part.vertices, 6)} - {
        tuple(p) for p in np.round(solid.vertices, 6)
    }
    sill = np.array([p for p in extra if p[1] == 3.0])
    assert len(sill) > 0
    assert (sill[:, 0] > 3.9).all()
    assert (np.abs(sill[:, 2]) < 0.6).all()


def test_opening_across_the_seam_of_a_tube_is_refused():
    """Its ring would leave the straight wall on one side: not silently a broken tube."""
    with pytest.raises(ValueError, match="180"):
        tube(5.0, 7.0, 1.0, 16, [Opening(180.0, 3.0, 1.0, 1.5)])


def test_revolved_cone_is_a_third_of_its_prism():
    part = revolved([(0.0, 1.0), (2.0, 1.0), (0.0, 4.0)], 12)
    assert open_edges(part) == []
    assert volume(part) == pytest.approx(regular_area(2.0, 12) * 3.0 / 3.0, rel=1e-12)


def test_revolved_disc_is_a_prism():
    part = revolved([(0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.0, 0.5)], 12)
    assert open_edges(part) == []
    assert volume(part) == pytest.approx(regular_area(2.0, 12) * 0.5, rel=1e-12)


def test_slab_lies_below_zero_and_has_its_stairwell_where_it_was_drawn():
    hole = [(1.0, 2.0), (2.0, 2.0), (2.0, 4.0), (1.0, 4.0)]
    part = slab(10.0, 12.0, 0.5, [hole])
    assert open_edges(part) == []
    assert volume(part) == pytest.approx((120.0 - 2.0) * 0.5, rel=1e-12)
    assert part.vertices[:, 1].min() == -0.5
    assert part.vertices[:, 1].max() == 0.0
    assert {(1.0, 2.0), (2.0, 4.0)} <= {(float(x), float(z)) for x, _, z in part.vertices}


def test_room_has_four_walls_and_an_opening_on_the_side_asked_for():
    east = [Opening(0.0, 1.0, 1.0, 1.0)]
    part = room(8.0, 6.0, 3.0, 0.5, ((), east, (), ()))
    assert open_edges(part) == []
    assert volume(part) == pytest.approx((8.0 * 6.0 - 7.0 * 5.0) * 3.0 - 0.5, rel=1e-12)
    sill = part.vertices[part.vertices[:, 1] == 1.0]
    assert (sill[:, 0] >= 3.5).all()
    assert part.vertices.min(axis=0).tolist() == [-4.0, 0.0, -3.0]
    assert part.vertices.max(axis=0).tolist() == [4.0, 3.0, 3.0]


def test_quarter_turns_keep_the_winding_and_return_after_four():
    part = box(1.0, 2.0, 3.0).moved(x=5.0, z=1.0)
    assert part.turned(1).vertices.mean(axis=0).tolist() == [1.0, 1.0, -5.0]
    for quarters in range(4):
        assert volume(part.turned(quarters)) == pytest.approx(6.0)
    assert (part.turned(4).vertices == part.vertices).all()


def test_joined_keeps_every_piece():
    part = joined([box(1.0, 1.0, 1.0), box(2.0, 2.0, 2.0).moved(x=9.0)])
    assert open_edges(part) == []
    assert volume(part) == pytest.approx(9.0)
