"""Azimuths along which prisms are seen, against lines that are sampled closely."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from simplifier.visibility.checking.exact_view import Prisms, seen_along, seen_from

STEP = 0.01


def outline(x, y, width, depth, turn):
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * [width, depth]
    c, s = np.cos(turn), np.sin(turn)
    return corners @ np.array([[c, s], [-s, c]]) + [x, y]


def scattered(seed, count=7):
    random = np.random.default_rng(seed)
    plans, kept = [], []
    while len(kept) < count:
        one = outline(*random.uniform(-9.0, 9.0, 2), *random.uniform(0.4, 1.5, 2), random.random())
        shape = shapely.Polygon(one)
        if shape.distance(shapely.Point(0, 0)) > 0.5 and all(shape.disjoint(o) for o in plans):
            plans.append(shape)
            kept.append(one)
    return kept, plans, random.uniform(1.0, 8.0, count)


def rising(plans, tops, eye, angle, rise):
    """Prisms whose top comes up along an azimuth by more than ``rise`` over all before."""
    steepest, seen = -np.inf, set()
    t = np.arange(STEP, 16.0, STEP)
    points = eye[:2] + t[:, None] * [np.cos(angle), np.sin(angle)]
    inside = [shapely.contains_xy(plan, points) for plan in plans]
    for place in range(len(t)):
        for prism, within in enumerate(inside):
            if within[place]:
                slope = (tops[prism] - eye[2]) / t[place]
                if slope > steepest + rise / t[place]:
                    seen.add(prism)
                steepest = max(steepest, slope)
    return seen


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("height", [0.5, 9.0])
def test_what_is_seen_rises_along_its_azimuth(seed, height):
    outlines, plans, tops = scattered(seed)
    prisms = Prisms.of_outlines(outlines, tops)
    eye = np.array([0.0, 0.0, height])
    angles = np.arange(24) * 2.0 * np.pi / 24 + 0.1
    found = seen_along(prisms, eye[None], angles)[0]
    strictly = set()
    for angle in angles:
        strictly |= rising(plans, tops, eye, angle, 0.2)
    seen = set(np.flatnonzero(~np.isnan(found)).tolist())
    assert strictly <= seen
    for prism in seen:
        assert prism in rising(plans, tops, eye, found[prism], -0.05)


def test_corners_are_looked_past():
    wall = [outline(5.0, y, 0.5, 4.0, 0.0) for y in (-4.05, 4.05)]
    outlines = [*wall, outline(9.0, 0.0, 0.2, 0.2, 0.0), outline(9.0, 4.0, 0.2, 0.2, 0.0)]
    prisms = Prisms.of_outlines(outlines, np.array([9.0, 9.0, 3.0, 3.0]))
    found = ~np.isnan(seen_from(prisms, np.array([[0.0, 0.0, 1.0]]), 0))[0]
    assert found.tolist() == [True, True, True, False]
    none = seen_from(prisms, np.array([[0.0, 0.0, 1.0], [5.0, 4.0, 1.0]]), 0, near=0.1)
    assert np.isnan(none).all()


def test_a_margin_wants_more_than_a_glimpse():
    outlines = [outline(4.0, 0.0, 0.5, 3.0, 0.0), outline(8.0, 0.0, 0.5, 3.0, 0.0)]
    # Over the near wall, 3 high at 4.5, one sees what is above 1 + 2 / 3.5 x 7.5 = 5.286.
    eye = np.array([[0.0, 0.0, 1.0]])
    for top, margin, seen in ((5.2, 0.0, False), (5.4, 0.0, True), (5.4, 0.3, False)):
        prisms = Prisms.of_outlines(outlines, np.array([3.0, top]))
        found = seen_along(prisms, eye, np.array([0.01]), margin)[0]
        assert (~np.isnan(found)).tolist() == [True, seen]
