"""Pictures around a point show what is there, in the right direction."""

from __future__ import annotations

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.visibility.checking.exact_view import prisms_of, seen_from
from simplifier.visibility.checking.panorama import Panorama

EYE = np.array([1.0, 2.0, 3.0])


def around(size=2.0, distance=10.0):
    """Boxes in all six directions and in the corners between them."""
    steps = [np.array([x, y, z]) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    middles = np.array([EYE + distance * step for step in steps if step.any()])
    boxes = np.stack([middles - 0.5 * size, middles + 0.5 * size], axis=1)
    return middles, scene_of_boxes(boxes, [f"box {index}" for index in range(len(boxes))])


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_boxes_on_all_sides_are_seen_where_they_are(up):
    middles, scene = around()
    towards = Panorama(scene, up, 128).seen_from(EYE)
    ahead = (middles - EYE) / np.linalg.norm(middles - EYE, axis=1)[:, None]
    assert ((towards * ahead).sum(axis=1) > np.cos(np.radians(12.0))).all()
    assert np.linalg.norm(towards, axis=1) == pytest.approx(1.0)


def test_what_has_no_two_by_two_pixels_or_is_hidden_is_not_seen():
    _, scene = around(size=0.1)
    assert np.isnan(Panorama(scene, "z", 64).seen_from(EYE)).all()
    assert not np.isnan(Panorama(scene, "z", 1024).seen_from(EYE)).any()
    shell = np.array([[EYE - 20.0, EYE + 20.0], [EYE + 30.0, EYE + 33.0], [EYE + 5.0, EYE + 6.0]])
    seen = ~np.isnan(Panorama(scene_of_boxes(shell, "abc"), "z", 64).seen_from(EYE)[:, 0])
    assert seen.tolist() == [True, False, True]


def test_an_eye_that_nearly_touches_sees_nothing():
    boxes = np.array([[EYE + np.array([1e-8, -9.0, -9.0]), EYE + 9.0], [EYE + 20.0, EYE + 30.0]])
    assert np.isnan(Panorama(scene_of_boxes(boxes, "ab"), "z", 64).seen_from(EYE)).all()


def test_lines_past_corners_find_all_that_pictures_show():
    city = generated_city(6, seed=4)
    prisms, panorama = prisms_of(city, "z"), Panorama(city, "z", 256)
    shown = 0
    for height in (0.0, 20.0, 60.0):
        for place in street_cells(city, 3, seed=1).high + np.array([0.0, 0.0, height]):
            picture = ~np.isnan(panorama.seen_from(place)[:, 0])
            lines = ~np.isnan(seen_from(prisms, (place - prisms.origin)[None], 360)[0])
            assert not (picture & ~lines).any()
            shown += np.count_nonzero(picture)
    assert shown > 300
