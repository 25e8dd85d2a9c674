"""Polygons to triangles, against the areas that shapely finds."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.errors import UnreadableMeshError
from simplifier.io.polygons import triangulate_polygons
from simplifier.kernels.ears import clip_ears


def triangulate(points: np.ndarray) -> np.ndarray:
    corners = np.arange(len(points))
    return triangulate_polygons(points, np.array([len(points)]), corners, where="test")


def flat(points: list[tuple[float, float]]) -> np.ndarray:
    return np.column_stack([np.array(points, dtype=float), np.zeros(len(points))])


def assert_covers(outline: np.ndarray, points: np.ndarray, faces: np.ndarray) -> None:
    """The triangles fill the outline, overlap nowhere and wind as it does."""
    polygon = shapely.Polygon(outline)
    triangles = [shapely.Polygon(outline[face]) for face in faces]
    assert sum(one.area for one in triangles) == pytest.approx(polygon.area, rel=1e-9)
    assert shapely.union_all(triangles).symmetric_difference(polygon).area < 1e-9 * polygon.area
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    newell = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    assert ((normals @ newell) >= 0.0).all()


ARROW = [(0.0, 0.0), (2.0, -1.0), (1.0, 0.0), (2.0, 1.0)]  # reflex at corner 2
COMB = [
    (0, 0),
    (7, 0),
    (7, 3),
    (6, 3),
    (6, 1),
    (4, 1),
    (4, 3),
    (3, 3),
    (3, 1),
    (1, 1),
    (1, 3),
    (0, 3),
]


@pytest.mark.parametrize("first", range(4))
def test_a_quadrilateral_is_cut_at_its_reflex_corner(first: int) -> None:
    points = flat(ARROW[first:] + ARROW[:first])
    assert_covers(points[:, :2], points, triangulate(points))


@pytest.mark.parametrize("first", range(4))
def test_a_corner_in_the_middle_of_an_edge(first: int) -> None:
    outline = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.0, 1.0)]
    points = flat(outline[first:] + outline[:first])
    faces = triangulate(points)
    assert_covers(points[:, :2], points, faces)
    assert len(faces) == 2


@pytest.mark.parametrize("first", range(len(COMB)))
@pytest.mark.parametrize("turn", [1, -1])
def test_a_comb(first: int, turn: int) -> None:
    points = flat((COMB[first:] + COMB[:first])[::turn])
    faces = triangulate(points)
    assert_covers(points[:, :2], points, faces)
    assert len(faces) == len(COMB) - 2


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 12))
def test_star_shaped_polygons_in_any_plane(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    angles = (np.arange(count) + generator.uniform(0.1, 0.9, count)) * (2.0 * np.pi / count)
    outline = generator.uniform(0.2, 1.0, (count, 1)) * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    frame, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    points = outline @ frame[:2] + generator.uniform(-5.0, 5.0, 3)
    assert_covers(outline, points, triangulate(points))


@pytest.mark.parametrize("repeated", range(4))
def test_a_triangle_as_a_quadrilateral_is_not_sent_to_ear_clipping(
    repeated: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a million of them took ten seconds."""
    monkeypatch.setattr("simplifier.io.polygons._clip_ears", None)
    corners = [0, 1, 2]
    corners.insert(repeated, corners[repeated - 1] if repeated else 2)
    points = flat([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)])
    faces = triangulate_polygons(points, np.array([4]), np.array(corners), where="test")
    a, b, c = np.moveaxis(points[faces], 1, 0)
    areas = np.cross(b - a, c - a)[:, 2] / 2.0
    assert sorted(areas.tolist()) == [0.0, 1.0]


def test_order_and_sizes_are_mixed() -> None:
    points = flat([*ARROW, (5.0, 5.0), (6.0, 5.0), (5.0, 6.0)])
    sizes = np.array([3, 4, 2, 1, 0, 3])
    corners = np.array([4, 5, 6, 0, 1, 2, 3, 0, 1, 2, 6, 5, 4])
    faces = triangulate_polygons(points, sizes, corners, where="test")
    assert faces.tolist() == [[4, 5, 6], [0, 1, 2], [0, 2, 3], [6, 5, 4]]


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e308])
def test_no_number_still_gives_triangles_to_be_counted(value: float) -> None:
    points = flat(COMB)
    points[3, 0] = value
    points[5, 0] = -value
    assert 0 < len(triangulate(points)) <= len(COMB) - 2


def test_a_polygon_without_area() -> None:
    points = np.outer(np.arange(5.0), [1.0, 2.0, 3.0])
    assert triangulate(points).shape == (3, 3)


def test_tiny_polygons_do_not_underflow() -> None:
    points = flat(ARROW) * 1e-150
    assert_covers(points[:, :2] * 1e150, points * 1e150, triangulate(points))


def test_corner_out_of_range_names_the_face() -> None:
    points = flat(ARROW)
    with pytest.raises(UnreadableMeshError, match="face 1 names vertex 4"):
        triangulate_polygons(points, np.array([3, 3]), np.array([0, 1, 2, 0, 4, 1]), where="test")


def star(count: int, seed: int) -> np.ndarray:
    """An outline with a bend at every corner."""
    generator = np.random.default_rng(seed)
    angles = (np.arange(count) + generator.uniform(0.1, 0.9, count)) * (2.0 * np.pi / count)
    spokes = np.column_stack([np.cos(angles), np.sin(angles)])
    return generator.uniform(0.2, 1.0, (count, 1)) * spokes


def shoelace(a: np.ndarray, b: np.ndarray) -> float:
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def twice_area(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[faces][..., :2], 1, 0)
    return shoelace(b - a, c - a)


@pytest.mark.parametrize("count", [65, 66, 200, 1500])
def test_an_outline_of_many_corners(count: int) -> None:
    outline = star(count, count)
    points = flat(outline.tolist())
    faces = triangulate(points)
    assert len(faces) == count - 2
    assert_covers(outline, points, faces)


def test_a_coast_of_a_million_corners() -> None:
    """Its looks are few a corner: such a face is cut right in spite of the bound on them."""
    count = 1 << 20
    way = np.arange(count) / count
    rng = np.random.default_rng(5)
    radius = np.ones(count)
    for bays in 2 ** np.arange(3, 20):
        depths = rng.normal(size=bays)
        radius += np.interp(way * bays, np.arange(bays + 1), [*depths, depths[0]]) / bays**0.6
    angle = 2.0 * np.pi * way
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    outline = np.maximum(radius, 0.1)[:, None] * around
    points = np.column_stack([outline, np.zeros(count)])
    faces = triangulate(points)
    edges = np.diff(points[faces], axis=1)
    assert (np.cross(edges[:, 0], edges[:, 1])[:, 2] >= 0.0).all()
    assert twice_area(points, faces) == pytest.approx(
        shoelace(outline, np.roll(outline, -1, axis=0)), rel=1e-9
    )


def test_a_comb_of_many_teeth() -> None:
    teeth = [(x, 3 if x % 4 in (0, 3) else 1) for x in range(399, -1, -1)]
    points = flat([(0, 0), (399, 0), *teeth])
    assert_covers(points[:, :2], points, triangulate(points))


def test_a_hole_that_a_bridge_joins() -> None:
    """As exporters write a plate with a hole: the bridge is walked there and back."""
    around = np.linspace(0.0, 2.0 * np.pi, 101)
    ring = np.column_stack([np.cos(around), np.sin(around)])
    outline = np.concatenate([3.0 * ring, ring[::-1]])
    points = flat(outline.tolist())
    faces = triangulate(points)
    triangles = [shapely.Polygon(outline[face]) for face in faces]
    plate = shapely.Polygon(3.0 * ring, [ring])
    assert sum(one.area for one in triangles) == pytest.approx(plate.area, rel=1e-9)
    assert shapely.union_all(triangles).symmetric_difference(plate).area < 1e-6


@pytest.mark.parametrize("gap", [0.5, 0.0])
def test_holes_that_bridges_join_in_a_chain(gap: float) -> None:
    """Along the upper halves of the holes and back along the lower ones: both ends of a bridge are
    passed twice, and a place at which two holes touch four times."""
    half = np.linspace(0.0, np.pi, 9)
    lower = np.column_stack([-np.cos(half), -np.sin(half)])
    middles = [np.array([k * (2.0 + gap), 0.0]) for k in range(12)]
    there = [point for middle in middles for point in middle + lower * (1.0, -1.0)]
    back = [point for middle in middles[::-1] for point in middle + lower * (-1.0, 1.0)]
    right = middles[-1][0] + 3.0
    outer = [(-3.0, 0.0), (-3.0, -2.0), (right, -2.0), (right, 2.0), (-3.0, 2.0), (-3.0, 0.0)]
    outline = np.array([*outer, *there, *back])
    points = flat(outline.tolist())
    triangles = [shapely.Polygon(outline[face]) for face in triangulate(points)]
    holes = [np.concatenate([lower, -lower]) + middle for middle in middles]
    plate = shapely.Polygon(outer).difference(shapely.union_all(list(map(shapely.Polygon, holes))))
    assert sum(one.area for one in triangles) == pytest.approx(plate.area, rel=1e-9)
    assert shapely.union_all(triangles).symmetric_difference(plate).area < 1e-6


@pytest.mark.parametrize("pattern", [[0, 1, 2], [0, 1, 2, 3, 2, 1], [0, 0, 1, 3]])
def test_a_face_of_repeated_corners_adds_up_to_its_outline(pattern: list[int]) -> None:
    """8,000 of them took 44 seconds."""
    points = flat([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
    corners = np.array(pattern * 5000)
    faces = triangulate_polygons(points, np.array([len(corners)]), corners, where="test")
    ends = points[np.roll(corners, -1)]
    around = shoelace(points[corners], ends)
    assert twice_area(points, faces) == pytest.approx(around, abs=1e-6)


def test_the_looks_are_bounded() -> None:
    """Whatever they are spent on, all of the ring is cut up, and the areas add up."""
    outline = star(3000, 1)
    for most in (0, 1, 3000, 30_000):
        triangles = np.empty((2998, 3), dtype=np.int64)
        count = clip_ears(outline, np.arange(3000), most, triangles)
        assert twice_area(outline, triangles[:count]) == pytest.approx(
            2.0 * shapely.Polygon(outline).area, rel=1e-9
        )
