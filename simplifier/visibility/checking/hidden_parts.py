"""Slices of objects -> points of what they hide -> which of these are certainly seen after all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.pvs import SLICES, Pvs
from simplifier.geometry.scene import Scene, axis_order
from simplifier.visibility.checking.exact_view import Prisms, seen_along

_HAIR = 1e-7  # of the extent: so far before a surface its points are looked at
_BELOW = 1.0 - 1e-6  # of that: as much below them must be seen, or roofs were seen from below
_INWARD = 1e-3  # of the way to the middle of a polygon, so that they are not on its border
_MOST = 24  # triangles of an object, the largest ones


def hidden_boxes(boxes: FloatArray, values: NDArray[np.int8], count: int = SLICES) -> FloatArray:
    """(k, 2, 3) the block of each box (k, 2, 3) that its slices (k, 3) hide; NaN where none is."""
    hidden = boxes.copy()
    share = values / count * (boxes[:, 1] - boxes[:, 0])
    for axis in (0, 1):
        low, high = values[:, axis] > 0, values[:, axis] < 0
        hidden[low, 0, axis] += share[low, axis]
        hidden[high, 1, axis] = boxes[high, 0, axis] - share[high, axis]
    tall = values[:, 2] > 0  # the first slice that is drawn
    step = (boxes[:, 1, 2] - boxes[:, 0, 2]) / count
    hidden[tall, 1, 2] = (boxes[:, 0, 2] + (values[:, 2] - 1) * step)[tall]
    hidden[(values == 0).all(axis=1)] = np.nan
    return hidden


class HiddenParts:
    """What the slices of a scene's sets hide, to be looked at from points.

    Of objects that are upright prisms any point is looked at; of others those alone that are on the
    border of the column around the object, since lines do not enter it.
    """

    def __init__(self, scene: Scene, pvs: Pvs, prisms: Prisms) -> None:
        self._scene, self._pvs = scene, pvs
        self._order = axis_order(pvs.up)
        self._boxes = scene.bounds()[:, :, self._order]
        count = len(prisms)
        # A column without walls beside each object has its points, since lines pass through their
        # own: here what is behind other parts of its object is hidden.
        self._prisms = replace(
            prisms,
            offsets=np.append(prisms.offsets, np.full(count, prisms.offsets[-1])),
            tops=np.append(prisms.tops, np.full(count, prisms.tops.min())),
            upright=np.zeros(2 * count, dtype=np.bool_),
        )

    def seen_from(self, cell: int, eyes: FloatArray) -> FloatArray:
        """(k, n) along which azimuth each eye (k, 3), world with z up, certainly sees a point of an
        object that the cell's slices hide, radians from x to y; NaN if not proven.
        """
        points, owners = self._points(cell)
        count = len(self._boxes)
        looked = replace(
            self._prisms,
            points=points - self._prisms.origin,
            point_of=(owners + count).astype(np.int32),
        )
        margin = _BELOW * _HAIR * self._prisms.extent
        return seen_along(looked, eyes - self._prisms.origin, np.empty(0), margin)[:, count:]

    def _points(self, cell: int) -> tuple[FloatArray, NDArray[np.int64]]:
        """(p, 3) points a hair before surfaces that are hidden, and the objects (p,)."""
        assert self._pvs.slices is not None
        objects = np.flatnonzero(self._pvs.visible(cell))
        values = self._pvs.slices.of(cell)
        hidden = hidden_boxes(self._boxes[objects], values, self._pvs.slices.count)
        hair = _HAIR * self._prisms.extent
        points, owners = [np.empty((0, 3))], []
        for index in np.flatnonzero(values.any(axis=1)).tolist():
            mesh = self._scene.joined([int(objects[index])])
            some = surface_points(mesh.vertices[:, self._order], mesh.faces, hidden[index], hair)
            points.append(some)
            owners += [int(objects[index])] * len(some)
        return np.concatenate(points), np.array(owners, dtype=np.int64)


def surface_points(
    vertices: FloatArray, faces: IntArray, box: FloatArray, hair: float
) -> FloatArray:
    """(p, 3) points a ``hair`` before and behind the largest triangles that reach in a box (2, 3).

    They are near the corners and in the middle of what of each is within.
    """
    triangles = vertices[faces]
    within = (triangles.min(axis=1) <= box[1]).all(axis=1)
    within &= (triangles.max(axis=1) >= box[0]).all(axis=1)
    triangles = triangles[within]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    points = [np.empty((0, 3))]
    for place in np.argsort(-areas, kind="stable")[:_MOST].tolist():
        polygon = np.array(_clipped(triangles[place].tolist(), box.tolist())).reshape(-1, 3)
        if len(polygon) < 3 or areas[place] == 0.0:
            continue
        middle = polygon.mean(axis=0)
        some = np.concatenate([polygon + _INWARD * (middle - polygon), middle[None]])
        off = hair / areas[place] * normals[place]
        points += [some + off, some - off]
    return np.concatenate(points)


def _clipped(corners: list[list[float]], box: list[list[float]]) -> list[list[float]]:
    """The corners of what of a convex polygon is in a box: one half-space after the other."""
    for axis in range(3):
        for side, bound in ((1.0, box[0][axis]), (-1.0, box[1][axis])):
            kept: list[list[float]] = []
            for one, two in zip(corners, corners[1:] + corners[:1], strict=True):
                here, there = side * (one[axis] - bound), side * (two[axis] - bound)
                if here >= 0.0:
                    kept.append(one)
                if (here < 0.0) != (there < 0.0) and here != there:
                    share = here / (here - there)
                    kept.append([a + share * (b - a) for a, b in zip(one, two, strict=True)])
            corners = kept
    return corners
