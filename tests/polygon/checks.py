"""What every stage of the polygon code promises, checked with shapely."""

from __future__ import annotations

import numpy as np
import shapely

from simplifier.geometry.section import Chain, Polygon, signed_area
from simplifier.polygon.chain import triangulate


def region(polygon: Polygon) -> shapely.Geometry:
    """The polygon's points; loops may visit a corner more than once."""
    return shapely.make_valid(shapely.Polygon(polygon.outer, polygon.holes))


def areas(ring: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (ring[triangles[:, i]] for i in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def covered(ring: np.ndarray, triangles: np.ndarray) -> shapely.Geometry:
    return shapely.union_all(shapely.polygons(ring[triangles]))


def outside(ring: np.ndarray, triangles: np.ndarray, original: shapely.Geometry) -> float:
    """Area of the triangles that is not in the original.

    Triangle by triangle: of their union, whose edges are those of a turned original but for
    rounding, GEOS 3.14 may return the whole as the difference.
    """
    shapely.prepare(original)
    return float(
        shapely.area(shapely.difference(shapely.polygons(ring[triangles]), original)).sum()
    )


def assert_triangulated(
    ring: np.ndarray, triangles: np.ndarray, original: shapely.Geometry
) -> None:
    """Counter-clockwise triangles inside the original that add up to the ring, none overlapping.

    That such triangles exist is also what makes a ring weakly simple.
    """
    area = signed_area(ring)
    sizes = areas(ring, triangles)
    assert triangles.dtype == np.int32
    assert triangles.shape[1] == 3
    assert len(triangles) <= len(ring) - 2
    assert (sizes > 0.0).all()
    assert abs(sizes.sum() - area) <= 1e-9 * area
    assert abs(covered(ring, triangles).area - area) <= 1e-9 * max(area, 1.0)
    assert outside(ring, triangles, original) < 1e-9


def assert_chain(chain: Chain, original: shapely.Geometry, *, every: int = 1) -> None:
    """Counts, areas, simplicity and containment at the first 12 and every n-th level."""
    assert chain.lowest.dtype == np.int32
    assert sorted(chain.lowest)[2:] == list(range(1, chain.triangles + 1))
    assert sorted(chain.lowest)[:2] == [1, 1]
    for level in range(1, chain.triangles + 1):
        if level > 12 and level % every and level != chain.triangles:
            continue
        member = chain.at(level)
        assert len(member) == level + 2
        assert_triangulated(member, triangulate(member), original)
