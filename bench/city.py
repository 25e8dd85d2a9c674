"""A city from the street: boxes as occluders, and boxes to be judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray

_BLOCK, _STREET = 15.0, 6.0  # metres: a house's plot and the street beside it
_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [1, 5, 7, 3]], dtype=np.int64
)  # four walls and a roof, corners numbered 4 x + 2 y + z with z up


@dataclass(frozen=True, eq=False)
class City:
    """``triangles`` (m, 3, 3) of houses and ``boxes`` (n, 2, 3), metres, all within the view."""

    camera: Camera
    triangles: FloatArray
    boxes: FloatArray


def city(height: float, triangles: int = 10_000, boxes: int = 10_000, seed: int = 0) -> City:
    """Houses on a grid of streets, seen from ``height`` metres above one, the nearest first.

    The boxes are things of 0.3 to 12 m on the ground or in the air, anywhere in the view as far as
    the houses reach, in no order.
    """
    rng = np.random.default_rng(seed)
    camera = Camera.looking(
        np.array([0.0, 0.0, height]), np.array([1.0, 0.35, -0.02]), np.array([0.0, 0.0, 1.0]),
        60.0, 0.1,
    )  # fmt: skip
    houses = _seen(_houses(rng), camera)[: triangles // 10]
    reach = np.linalg.norm(houses[-1].mean(axis=0) - camera.position)
    centres = rng.uniform(-1.0, 1.0, (8 * boxes, 3)) * [reach, reach, 0.0]
    half = np.exp(rng.uniform(np.log(0.15), np.log(6.0), (8 * boxes, 3)))
    centres[:, 2] = half[:, 2] + rng.choice([0.0, 20.0], 8 * boxes, p=[0.8, 0.2])
    things = _seen(np.stack([centres - half, centres + half], axis=1), camera)
    return City(camera, _walls(houses)[:triangles], rng.permutation(things)[:boxes])


def _houses(rng: np.random.Generator) -> FloatArray:
    """(n, 2, 3) boxes of 60 x 60 plots; the camera's street is free."""
    places = (np.arange(-60, 60) + 0.5) * (_BLOCK + _STREET)
    x, y = (axis.ravel() for axis in np.meshgrid(places, places))
    low = np.column_stack([x, y, np.zeros_like(x)])
    low[:, :2] -= rng.uniform(0.3, 0.5, (len(x), 2)) * _BLOCK
    high = np.column_stack([x, y, rng.lognormal(3.3, 0.5, len(x))])
    high[:, :2] += rng.uniform(0.3, 0.5, (len(x), 2)) * _BLOCK
    return np.stack([low, high], axis=1)


def _seen(boxes: FloatArray, camera: Camera) -> FloatArray:
    """Those with their centre in a view of 16 to 9, the nearest first."""
    points = (boxes.mean(axis=1) - camera.position) @ camera.axes.T
    half = np.tan(np.radians(0.5 * camera.fov)) * points[:, 2]
    inside = (np.abs(points[:, 0]) < half * 16.0 / 9.0) & (np.abs(points[:, 1]) < half)
    inside &= points[:, 2] > 1.0
    order = np.argsort(points[:, 2], kind="stable")
    return boxes[order[inside[order]]]


def _walls(boxes: FloatArray) -> FloatArray:
    """(10 n, 3, 3) triangles of the walls and roofs."""
    corner = np.arange(8)
    x, y, z = boxes[:, corner >> 2, 0], boxes[:, (corner >> 1) & 1, 1], boxes[:, corner & 1, 2]
    corners = np.stack([x, y, z], axis=-1)
    quads = corners[:, _FACES]
    halves = np.stack([quads[:, :, [0, 1, 2]], quads[:, :, [0, 2, 3]]], axis=2)
    return np.ascontiguousarray(halves.reshape(-1, 3, 3))
