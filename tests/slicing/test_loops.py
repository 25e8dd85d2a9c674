"""Edge loops against an exact polygoniser."""

from __future__ import annotations

import numpy as np
import pytest
import rasterio.features
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from simplifier.geometry.section import Plane, Polygon, Section, signed_area
from simplifier.slicing.loops import edge_loops

PLANE = Plane(np.eye(3), 0.0)


def trace(mask, corner=(0.0, 0.0), pixel=1.0) -> list[Polygon]:
    return edge_loops(Section(PLANE, np.asarray(mask, dtype=bool), np.array(corner), pixel))


def picture(*rows: str) -> np.ndarray:
    return np.array([[c == "#" for c in row] for row in rows])


def polygoniser(mask) -> list[frozenset]:
    """GDAL's pieces of 4-connected pixels, each as the directed edges of all its loops."""
    shapes = rasterio.features.shapes(mask.astype(np.uint8), mask, connectivity=4)
    pieces = []
    for geometry, _ in shapes:
        outer, *holes = [corners_only(np.array(ring[:-1])) for ring in geometry["coordinates"]]
        outer = outer if signed_area(outer) > 0 else outer[::-1]
        holes = [hole if signed_area(hole) < 0 else hole[::-1] for hole in holes]
        pieces.append(directed_edges([outer, *holes]))
    return pieces


def corners_only(ring: np.ndarray) -> np.ndarray:
    back, on = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    return ring[back[:, 0] * on[:, 1] != back[:, 1] * on[:, 0]]


def directed_edges(loops) -> frozenset:
    """What does not depend on where a walk begins or how it passes a corner visited twice.

    (GDAL makes such a corner the meeting of two rings, as simple features ask for.)
    """
    return frozenset(
        (*start, *end)
        for loop in loops
        for start, end in zip(loop.tolist(), np.roll(loop, -1, axis=0).tolist(), strict=True)
    )


def hole_areas(piece: np.ndarray) -> list[int]:
    """Pixels of each bounded region, connected across corners too, beside one piece's pixels."""
    regions, count = ndimage.label(~np.pad(piece, 1), structure=np.ones((3, 3)))
    sizes = np.bincount(regions.ravel(), minlength=count + 1)
    return sorted(int(sizes[i]) for i in range(1, count + 1) if i != regions[0, 0])


def assert_exact(mask: np.ndarray) -> None:
    polygons = trace(mask)
    edges = [directed_edges([p.outer, *p.holes]) for p in polygons]
    assert sorted(edges, key=sorted) == sorted(polygoniser(mask), key=sorted)
    labels, count = ndimage.label(mask)  # by default connected across edges, in row-major order
    assert count == len(polygons)
    for label, polygon in enumerate(polygons, 1):
        assert polygon.area == np.count_nonzero(labels == label)
        assert signed_area(polygon.outer) > 0
        areas = sorted(-signed_area(hole) for hole in polygon.holes)
        assert areas == hole_areas(labels == label)
        for loop in (polygon.outer, *polygon.holes):
            assert len(corners_only(loop)) == len(loop)


@given(hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9)))
@settings(max_examples=300, deadline=None)
def test_random_masks_equal_the_polygoniser(mask):
    assert_exact(mask)


@given(st.integers(0, 2**32 - 1), st.floats(0.2, 0.8), st.sampled_from([0.0, 0.7, 1.5, 4.0]))
@settings(max_examples=40, deadline=None)
def test_blobs_equal_the_polygoniser(seed, share, blur):
    noise = np.random.default_rng(seed).normal(size=(47, 61))
    field = ndimage.gaussian_filter(noise, blur) if blur else noise
    assert_exact(field > np.quantile(field, share))


@pytest.mark.parametrize(
    "mask",
    [
        np.ones((1, 1), bool),
        np.ones((7, 5), bool),
        np.indices((8, 9)).sum(axis=0) % 2 == 0,
        np.indices((8, 9)).sum(axis=0) % 2 == 1,
        np.eye(6, dtype=bool),
        np.indices((9, 9)).max(axis=0) % 2 == 0,
    ],
    ids=["pixel", "full", "checkerboard", "other_checkerboard", "diagonal", "chevrons"],
)
def test_regular_masks_equal_the_polygoniser(mask):
    assert_exact(mask)


def test_an_empty_mask_has_no_polygon():
    assert trace(np.zeros((4, 6), bool)) == []


def test_islands_in_holes_in_islands():
    size = 17
    rings = np.abs(np.indices((size, size)) - size // 2).max(axis=0)
    mask = rings % 4 < 2
    assert_exact(mask)
    # Chebyshev rings 0-1, 4-5 and 8: a core, a frame, and the outermost frame.
    assert [len(p.holes) for p in trace(mask)] == [1, 1, 0]


def test_a_hole_finds_its_outer_loop_past_other_holes():
    mask = picture(
        "########",
        "#.#..#.#",
        "###.####",
        "#.#..#.#",
        "########",
    )
    (polygon,) = trace(mask)
    assert len(polygon.holes) == 5
    assert_exact(mask)


def test_pieces_that_meet_at_a_corner_are_apart():
    polygons = trace(picture("#.", ".#"))
    assert [p.outer.tolist() for p in polygons] == [
        [[0, 0], [1, 0], [1, 1], [0, 1]],
        [[1, 1], [2, 1], [2, 2], [1, 2]],
    ]


def test_a_loop_that_meets_itself_visits_the_corner_twice():
    (polygon,) = trace(picture("###", "#.#", "##."))
    assert polygon.holes == ()
    assert [2.0, 2.0] in polygon.outer.tolist()
    assert polygon.outer.tolist().count([2.0, 2.0]) == 2
    assert polygon.area == 7.0


def test_holes_that_meet_at_a_corner_are_one():
    (polygon,) = trace(picture("####", "#.##", "##.#", "####"))
    assert len(polygon.holes) == 1
    assert signed_area(polygon.holes[0]) == -2.0


def test_coordinates_are_corner_plus_pixels():
    mask = picture("....", ".##.", "....")
    (polygon,) = trace(mask, corner=(-3.5, 10.25), pixel=0.75)
    expected = np.array([-3.5, 10.25]) + 0.75 * np.array([[1, 1], [3, 1], [3, 2], [1, 2]])
    assert polygon.outer.dtype == np.float64
    assert polygon.outer.tolist() == expected.tolist()


def test_the_layout_of_the_mask_does_not_matter():
    mask = np.random.default_rng(3).random((9, 13)) < 0.6
    plain, turned = trace(mask), trace(np.asfortranarray(mask))
    assert [p.outer.tolist() for p in plain] == [p.outer.tolist() for p in turned]


def test_the_pieces_cover_the_pixels():
    mask = np.random.default_rng(8).random((12, 12)) < 0.6
    union = shapely.union_all(
        [shapely.make_valid(shapely.Polygon(p.outer, p.holes)) for p in trace(mask)]
    )
    rows, columns = np.nonzero(mask)
    pixels = shapely.union_all(shapely.box(columns, rows, columns + 1, rows + 1))
    assert union.symmetric_difference(pixels).area == pytest.approx(0.0, abs=1e-12)
