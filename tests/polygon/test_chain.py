"""Simplification chains: each polygon inside the original, simple, one triangle less."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.section import Polygon, signed_area
from simplifier.kernels.chain import clip_ears
from simplifier.polygon.chain import simplification_chain
from simplifier.polygon.simplify import bridge_holes, simplify_polygon
from tests.polygon.checks import areas, assert_chain, covered, region
from tests.polygon.corpus import (
    PINCHED,
    PLANE,
    POLYGONS,
    blobs,
    box,
    loop,
    maze,
    pieces,
    random_star,
    simplified_blobs,
    square,
    variants,
)

ALL = [
    pytest.param(changed, id=f"{name}, {change}")
    for name, polygon in {**POLYGONS, **PINCHED}.items()
    for change, changed in variants(polygon)
]


def chain_of(polygon: Polygon):
    return simplification_chain(bridge_holes(polygon), PLANE)


def brute_force(ring: np.ndarray) -> list[float]:
    """Areas of the paper's chain, n - 2 triangles down to 1, every vertex tried with shapely.

    Reflex vertices are tried too: that none is ever taken is a claim of the implementation.
    """
    original = shapely.Polygon(ring).buffer(1e-9)
    found = [signed_area(ring)]
    while len(ring) > 3:
        best, least = None, np.inf
        for i in range(len(ring)):
            triangle = ring[[i - 1, i, (i + 1) % len(ring)]]
            size, rest = abs(signed_area(triangle)), np.delete(ring, i, axis=0)
            shape = shapely.Polygon(rest)
            if size < least and shape.is_valid and original.covers(shape):
                best, least = rest, size
        assert best is not None
        ring = best
        found.append(signed_area(ring))
    return found


@pytest.mark.parametrize("polygon", ALL)
def test_corpus(polygon):
    assert_chain(chain_of(polygon), region(polygon), every=5)


@given(st.integers(0, 2**32 - 1), st.integers(4, 13))
@settings(max_examples=60, deadline=None)
def test_equals_brute_force_over_all_vertices(seed, count):
    ring = random_star(seed, count, 0).outer
    chain = simplification_chain(ring, PLANE)
    ours = [signed_area(chain.at(t)) for t in range(chain.triangles, 0, -1)]
    assert ours == pytest.approx(brute_force(ring), rel=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(9, 40), st.integers(0, 8))
@settings(max_examples=60, deadline=None)
def test_stars(seed, count, holes):
    polygon = random_star(seed, count, holes)
    assert_chain(chain_of(polygon), region(polygon), every=7)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.5, 1.0]))
@settings(max_examples=60, deadline=None)
def test_masks(seed, tolerance):
    for polygon in simplified_blobs(seed, tolerance):
        assert_chain(chain_of(polygon), region(polygon), every=17)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_mazes(seed):
    (polygon,) = pieces(maze(seed, 7))
    assert_chain(chain_of(polygon), region(polygon), every=17)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_ears_tile_large_noisy_masks(seed):
    """Positive ears that add up and do not overlap: then every level is inside and simple."""
    for piece in pieces(blobs(seed, 64)):
        polygon = simplify_polygon(piece, 0.0)
        assert polygon is not None
        ring = bridge_holes(polygon)
        ears = clip_ears(ring)
        sizes = areas(ring, ears)
        assert sizes.min() > -1e-9
        assert sizes.sum() == pytest.approx(polygon.area, rel=1e-9)
        union = covered(ring, ears[sizes > 1e-9])
        assert union.area == pytest.approx(polygon.area, rel=1e-9)


def test_a_ring_of_a_thousand_vertices():
    polygon = random_star(2, 1000, 10)
    ring = bridge_holes(polygon)
    ears = clip_ears(ring)
    assert covered(ring, ears).area == pytest.approx(polygon.area, rel=1e-9)


def test_a_triangle_is_its_own_chain():
    chain = simplification_chain(loop((0, 0), (1, 0), (0, 1)), PLANE)
    assert chain.triangles == 1
    assert chain.lowest.tolist() == [1, 1, 1]
    assert chain.plane is PLANE


def test_the_least_area_goes_first():
    ring = loop((0, 0), (9, 0), (10, 1), (10, 8), (8, 10), (0, 10))
    chain = simplification_chain(ring, PLANE)
    # The corner cut at (9, 0)-(10, 1) is the smaller one.
    assert np.flatnonzero(chain.lowest == chain.triangles).tolist() in ([1], [2])


def test_an_ear_that_another_vertex_blocks_waits():
    # Without the notch's tip inside its triangle, vertex 1 would be the smallest.
    ring = loop((0, 0), (4, 0), (4, 4), (2.5, 1.2), (0, 9))
    chain = simplification_chain(ring, PLANE)
    assert chain.lowest[1] < chain.triangles
    assert_chain(chain, shapely.Polygon(ring))


def test_straight_and_repeated_points_go_first_and_change_nothing():
    ring = loop((0, 0), (2, 0), (4, 0), (4, 0), (4, 4), (0, 4), (0, 1))
    chain = simplification_chain(ring, PLANE)
    assert chain.triangles == 5
    for level in range(2, 6):
        assert signed_area(chain.at(level)) == 16.0


def test_the_chain_opens_up_holes_until_they_are_outside():
    polygon = Polygon(box(10, 10), (square(4, 4, 2),))
    chain = chain_of(polygon)
    assert chain.triangles == 8
    assert_chain(chain, region(polygon))
    sizes = [signed_area(chain.at(t)) for t in range(1, 9)]
    assert sizes == sorted(sizes)
    assert sizes[-1] == 96.0


def test_equal_rings_give_equal_chains():
    ring = bridge_holes(random_star(9, 40, 6))
    assert np.array_equal(
        simplification_chain(ring, PLANE).lowest, simplification_chain(ring.copy(), PLANE).lowest
    )


@pytest.mark.parametrize(
    "ring",
    [box(4, 3)[::-1].copy(), loop((0, 0), (4, 4), (4, 0), (0, 4), (2, 9)), np.zeros((6, 2))],
    ids=["clockwise", "crossing itself", "one point"],
)
def test_rings_that_break_the_promise_still_end(ring):
    chain = simplification_chain(ring, PLANE)
    assert sorted(chain.lowest) == [1, 1, *range(1, chain.triangles + 1)]
