"""Scenes of open sheets: houses of walls and roofs without floors, facades, and their ground.

All have z up and stand on the ground at z = 0, metres, unless they say otherwise.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from tests.solids import box

WALL_NAMES = ("west", "east", "south", "north", "floor", "roof")


def quad(*corners):
    """A sheet of four corners."""
    return TriangleMesh.from_soup(
        np.array(corners, dtype=np.float64), np.array([[0, 1, 2], [0, 2, 3]])
    )


def scene_of(sheets):
    """Meshes by name as a scene."""
    numbers = np.arange(len(sheets), dtype=np.int32)
    transforms = np.tile(np.eye(4), (len(sheets), 1, 1))
    return Scene(tuple(sheets.values()), tuple(sheets), numbers, transforms)


def house(name, low, high, without=("floor",)):
    """Walls and a roof, a sheet each, from ``low`` to ``high`` (3,)."""
    low, high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    return {
        f"{name} {wall}": box(high - low, low, without=set(range(6)) - {side})
        for side, wall in enumerate(WALL_NAMES)
        if wall not in without
    }


def wall_with_hole(x, y, top, hole):
    """A sheet at ``x`` over a range ``y``, with a ``hole``: low and high y, low and high z."""
    y0, y1, z0, z1 = hole
    ys, zs = [y[0], y0, y1, y[1]], [0.0, z0, z1, top]
    points = np.array([[x, a, b] for a in ys for b in zs], dtype=np.float64)
    quads = [
        [4 * i + j, 4 * i + 4 + j, 4 * i + 5 + j, 4 * i + 1 + j]
        for i in range(3)
        for j in range(3)
        if (i, j) != (1, 1) and zs[j] < zs[j + 1]
    ]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return TriangleMesh.from_soup(points, np.array(faces))


def house_with_hole(
    name="holed", low=(20.0, -10.0, 0.0), high=(36.0, 10.0, 9.0), hole=(-1, 1, 3, 5)
):
    """A house whose west wall has a hole."""
    sheets = house(name, low, high, ("floor", "west"))
    sheets[f"{name} west"] = wall_with_hole(low[0], (low[1], high[1]), high[2], hole)
    return sheets


def post(name="post", at=(60.0, 0.0)):
    """A closed box of 2 x 2 x 4."""
    return {name: box((2.0, 2.0, 4.0), (at[0] - 1.0, at[1] - 1.0, 0.0))}
