"""The set that culling is timed on is what it says."""

from __future__ import annotations

import numpy as np

from bench.city import city


def test_a_city_has_what_was_asked_for_all_within_the_view():
    scene = city(1.7, triangles=500, boxes=300)
    assert scene.triangles.shape == (500, 3, 3)
    assert scene.boxes.shape == (300, 2, 3)
    assert (scene.boxes[:, 0] < scene.boxes[:, 1]).all()
    local = (scene.boxes.mean(axis=1) - scene.camera.position) @ scene.camera.axes.T
    half = np.tan(np.radians(30.0)) * local[:, 2]
    assert (np.abs(local[:, 1]) < half).all()
    assert (np.abs(local[:, 0]) < half * 16.0 / 9.0).all()


def test_houses_are_whole_and_the_nearest_first():
    scene = city(30.0, triangles=500, boxes=10)
    houses = scene.triangles.reshape(50, 30, 3)
    depth = (houses.mean(axis=1) - scene.camera.position) @ scene.camera.axes[2]
    assert (np.sort(depth) == depth).mean() > 0.9  # by their boxes, which are near the mean corner
    assert (houses[:, :, 2].min(axis=1) == 0.0).all()
    assert (np.ptp(houses, axis=1) > 1.0).all()
