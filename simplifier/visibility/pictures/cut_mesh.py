"""Triangles -> what of them lies out of a box, and the creases within it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

_FLAT = 0.9  # cosine of the largest angle between neighbours that is no crease


def outside(triangles: FloatArray, box: FloatArray) -> FloatArray:
    """(m, 3, 3) triangles that cover what of ``triangles`` (n, 3, 3) is out of a box (2, 3).

    They keep their winding.  Some may have no area.
    """
    kept = []
    for axis in range(3):
        below, triangles = _split(triangles, axis, float(box[0, axis]))
        triangles, above = _split(triangles, axis, float(box[1, axis]))
        kept += [below, above]
    return np.concatenate(kept)


def _split(triangles: FloatArray, axis: int, bound: float) -> tuple[FloatArray, FloatArray]:
    """Triangles below a plane across an axis, and those above; what lies in it is above."""
    heights = triangles[:, :, axis] - bound
    above = (heights >= 0.0).all(axis=1)
    below = (heights <= 0.0).all(axis=1) & ~above
    mixed = np.flatnonzero(~above & ~below)
    positive = heights[mixed] > 0.0
    tip_above = positive.sum(axis=1) == 1
    tips = np.where(tip_above, positive.argmax(axis=1), positive.argmin(axis=1))
    a, b, c = (triangles[mixed, (tips + turn) % 3] for turn in range(3))
    ab, ac = _crossing(a, b, axis, bound), _crossing(a, c, axis, bound)
    alone = np.stack([a, ab, ac], axis=1)
    rest = np.stack([np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)], axis=1)
    return (
        np.concatenate([
            triangles[below], alone[~tip_above], rest[tip_above].reshape(-1, 3, 3)
        ]),
        np.concatenate([
            triangles[above], alone[tip_above], rest[~tip_above].reshape(-1, 3, 3)
        ]),
    )  # fmt: skip


def _crossing(one: FloatArray, two: FloatArray, axis: int, bound: float) -> FloatArray:
    """(n, 3) where edges between points (n, 3) on either side of a plane meet it."""
    here, there = one[:, axis] - bound, two[:, axis] - bound
    points = one + (here / (here - there))[:, None] * (two - one)
    points[:, axis] = bound
    return np.asarray(points)


def creases(triangles: FloatArray) -> FloatArray:
    """(k, 2, 3) edges of triangles (n, 3, 3) where one alone ends, or two meet at an angle."""
    points, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = corners.reshape(-1, 3)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals / np.maximum(lengths, 1e-300), 3, axis=0)
    known, which, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    firsts = np.cumsum(counts) - counts
    first = normals[order[firsts]]
    other = normals[order[firsts + np.minimum(counts - 1, 1)]]
    turned = (first * other).sum(axis=1) < _FLAT
    lines: FloatArray = points[known[(counts != 2) | turned]]
    return lines


def within(lines: FloatArray, box: FloatArray) -> FloatArray:
    """(m, 2, 3) what of lines (k, 2, 3) is in a box (2, 3)."""
    begin, step = lines[:, 0], lines[:, 1] - lines[:, 0]
    enter, leave = np.zeros(len(lines)), np.ones(len(lines))
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis in range(3):
            shares = (box[:, axis] - begin[:, axis, None]) / step[:, axis, None]
            level = step[:, axis] == 0.0
            inside = (begin[:, axis] >= box[0, axis]) & (begin[:, axis] <= box[1, axis])
            low, high = shares.min(axis=1), shares.max(axis=1)
            enter = np.maximum(enter, np.where(level, np.where(inside, 0.0, 2.0), low))
            leave = np.minimum(leave, np.where(level, 1.0, high))
    kept = enter < leave
    ends = np.stack([enter, leave], axis=1)[kept]
    return np.asarray(begin[kept, None] + ends[:, :, None] * step[kept, None])


def areas(triangles: FloatArray) -> NDArray[np.float64]:
    """(n,) of triangles (n, 3, 3)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(0.5 * np.linalg.norm(normals, axis=1))
