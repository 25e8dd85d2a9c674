"""Triangles of one plane merged: they cover the same points, with no corner but the union's own."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from simplifier.polygon.coplanar import group_by_plane, merge_coplanar
from tests.extremes.shapes import finer, soup
from tests.polygon.checks import region
from tests.polygon.corpus import POLYGONS
from tests.solids import box

TOLERANCE = 1e-4
UNIT = 10.0


def turned(points, seed=3):
    """Points (..., 3) turned about the origin."""
    axes, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return points @ (axes * np.sign(np.linalg.det(axes))).T


def in_space(flat):
    """Triangles (k, 3, 2) in a plane that is level, wound as they are."""
    return np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=-1)


def grid(across, size=UNIT):
    """A square of across * across quadrilaterals, two triangles each."""
    i, j = np.meshgrid(np.arange(across), np.arange(across), indexing="ij")
    low = np.stack([i.ravel(), j.ravel()], axis=-1)
    a, b, c, d = (low + step for step in ([0, 0], [1, 0], [1, 1], [0, 1]))
    flat = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return in_space(flat * (size / across))


def shifted(triangles, x=0.0, y=0.0, z=0.0):
    return triangles + np.array([x, y, z])


def tessellated(mesh, times):
    """Triangles of a mesh, each cut into four so many times."""
    cut = finer(mesh, times)
    return cut.vertices[cut.faces]


def merged(triangles, most=1000):
    groups = group_by_plane(triangles, TOLERANCE, most)
    return None if groups is None else merge_coplanar(triangles, groups, TOLERANCE, most)


def plan(triangles):
    """What level triangles cover, seen from above."""
    return shapely.union_all(shapely.polygons(triangles[..., :2]), grid_size=1e-7)


def assert_same_plan(found, given_triangles):
    expected = plan(given_triangles)
    assert len(found) > 0
    assert shapely.area(shapely.difference(plan(found), expected)) <= TOLERANCE * expected.length
    assert np.abs(found[..., 2]).max() <= TOLERANCE
    # Once each: the areas add up to that of the union.
    area = shapely.area(shapely.polygons(found[..., :2])).sum()
    assert abs(area - expected.area) <= TOLERANCE * expected.length


@pytest.mark.parametrize("times", [0, 1, 4])
@pytest.mark.parametrize("turn", [False, True])
def test_a_box_of_any_number_of_triangles_takes_twelve(times, turn):
    triangles = tessellated(box([UNIT, 7.0, 2.0]), times)
    triangles = turned(triangles) if turn else triangles
    found = merged(triangles)
    assert len(found) == 12
    corners = np.unique(np.round(found.reshape(-1, 3), 3), axis=0)
    assert len(corners) == 8
    assert np.abs(corners[:, None] - triangles.reshape(-1, 3)).max(axis=2).min(axis=1).max() < 1e-3


def test_they_are_wound_as_they_were():
    triangles = turned(tessellated(box([UNIT] * 3), 2))
    found = merged(triangles)
    normals = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    outwards = found.mean(axis=1) - triangles.reshape(-1, 3).mean(axis=0)
    assert ((normals * outwards).sum(axis=1) > 0.0).all()


def test_both_sides_of_a_sheet_count_once():
    sheet = grid(6)
    found = merged(np.concatenate([sheet, sheet[:, ::-1]]))
    assert len(found) == 2
    assert_same_plan(found, sheet)


def test_what_overlaps_counts_once():
    """Two crossing strips, of which no edges meet: a cross of twelve corners."""
    wide = shifted(grid(3) * [1.0, 0.2, 1.0], y=4.0)
    tall = shifted(grid(4) * [0.2, 1.0, 1.0], 4.0)
    found = merged(np.concatenate([wide, tall]))
    assert len(found) == 10
    assert_same_plan(found, np.concatenate([wide, tall]))


def test_edges_that_meet_in_part_leave_no_corner():
    """Three triangles beside four: the joint has corners on both sides that the other lacks."""
    left, right = grid(3), shifted(grid(4), UNIT)
    found = merged(np.concatenate([left, right]))
    assert len(found) == 2
    assert_same_plan(found, np.concatenate([left, right]))


@pytest.mark.parametrize("name", sorted(POLYGONS))
def test_holes_and_bays_stay_open(name):
    """Every polygon of the corpus, cut into many triangles."""
    shape = region(POLYGONS[name])
    cut = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    flat = np.array([shapely.get_coordinates(one)[:3] for one in cut])
    scale = UNIT / np.ptp(flat, axis=(0, 1)).max()
    triangles = in_space((flat - flat.min(axis=(0, 1))) * scale)
    many = tessellated(soup([triangles]), 1)
    found = merged(many)
    assert len(found) < len(many)
    assert_same_plan(found, triangles)


@given(st.integers(0, 10_000), st.integers(4, 60), st.floats(0.2, 1.0))
def test_any_part_of_any_triangulation(seed, count, share):
    random = np.random.default_rng(seed)
    points = np.round(random.random((count, 2)), 3) * UNIT
    points = np.unique(points, axis=0)
    faces = Delaunay(points).simplices
    kept = faces[random.random(len(faces)) < share]
    flat = points[kept]
    flat = flat[shapely.area(shapely.polygons(flat)) > 0.02]
    if len(flat) == 0:
        return
    triangles = in_space(flat)
    found = merged(triangles)
    if found is not None:  # none of a part that is too thin
        assert len(found) <= len(triangles)
        assert_same_plan(found, triangles)


def test_more_planes_or_triangles_than_are_allowed_are_none():
    triangles = tessellated(box([UNIT] * 3), 1)
    assert len(group_by_plane(triangles, TOLERANCE, 6)) == 6
    assert group_by_plane(triangles, TOLERANCE, 5) is None
    assert len(merged(triangles, 12)) == 12
    assert merged(triangles, 11) is None


def test_what_has_no_area_is_of_another_plane_or_of_none():
    level, line = grid(2), np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]])
    assert len(group_by_plane(np.concatenate([level, line]), TOLERANCE, 9)) == 1
    assert group_by_plane(np.concatenate([level, shifted(line, z=1.0)]), TOLERANCE, 9) is None


def test_a_plane_takes_what_lies_in_it_and_no_more():
    level = grid(2)
    above = shifted(level, z=2.0 * TOLERANCE)
    near = shifted(level * [0.5, 0.5, 1.0], z=0.5 * TOLERANCE)
    groups = group_by_plane(np.concatenate([level, above, near]), TOLERANCE, 9)
    assert sorted(sorted(one.which.tolist()) for one in groups) == [
        [*range(8), *range(16, 24)], [*range(8, 16)],
    ]  # fmt: skip


@pytest.mark.parametrize("width", [1e-7, 5e-5])
@pytest.mark.parametrize("beside", [False, True])
def test_what_is_thinner_than_the_tolerance_is_not_lost(width, beside):
    """A needle by itself, and one across a plane from a wall; thinner ones, rounded away, only
    count where nothing else is in their plane."""
    needle = in_space(np.array([[[0.0, 0.0], [UNIT, 0.0], [UNIT, width]]]))
    if beside:
        needle = np.concatenate([shifted(grid(2), y=UNIT), needle])
    assert (merged(needle) is None) is not (beside and width < 1e-6)


def test_many_that_overlap_would_take_too_long():
    few, many = grid(30), grid(60)
    assert merged(np.concatenate([few, shifted(few, 0.01)])) is not None
    assert merged(np.concatenate([many, shifted(many, 0.01)])) is None
    assert len(merged(many)) == 2
