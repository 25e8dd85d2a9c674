"""Bodies of buildings: a footprint drawn upwards, with windows as recesses in its walls.

Every wall meets its neighbours in its four corners alone, whatever windows it has, so a body is
closed without T-junctions.  Plans are (x, -z): seen from above with +x to the right and -z up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mapbox_earcut
import numpy as np
from numpy.typing import ArrayLike, NDArray

from examples.part import Part, joined, triples
from simplifier.geometry.mesh import FloatArray

_MARGIN = 0.9  # metres from a corner to the first window; more than a recess is deep


@dataclass(frozen=True)
class Facade:
    """Windows of all walls of a body, metres.

    ``rows``    (low, high) above the body's foot; what comes too near its top is left out.
    ``width``   of a window; 0 for one that runs from corner to corner.
    ``pitch``   from window to window.
    ``recess``  how deep the glass lies behind the wall.
    """

    rows: tuple[tuple[float, float], ...]
    width: float = 1.3
    pitch: float = 3.2
    recess: float = 0.3

    def columns(self, length: float) -> FloatArray:
        """(c, 2) left and right edge of the windows of a wall."""
        free = length - 2.0 * _MARGIN
        if self.width == 0.0:
            return np.array([[_MARGIN, length - _MARGIN]] if free > 2.0 else []).reshape(-1, 2)
        count = int((free - self.width) // self.pitch) + 1 if free >= self.width else 0
        left = (np.arange(count) - (count - 1) / 2.0) * self.pitch + (length - self.width) / 2.0
        return np.stack([left, left + self.width], axis=1)


def storeys(
    count: int, height: float = 3.2, ground: float = 4.0
) -> tuple[float, tuple[tuple[float, float], ...]]:
    """The height of a house of ``count`` storeys, and the rows of its windows."""
    feet = [ground + height * level for level in range(count - 1)]
    rows = [(0.6, ground - 0.8), *((foot + 0.9, foot + height - 0.7) for foot in feet)]
    return ground + height * (count - 1) + 0.4, tuple(rows)


def body(
    rings: Sequence[ArrayLike],
    low: float,
    high: float,
    facade: Facade | None = None,
    blank: Sequence[int] = (),
) -> Part:
    """One closed piece from ``low`` to ``high``.

    ``rings``  the plan: an outer ring, counter-clockwise, and clockwise holes; no straight corners.
    ``blank``  edges of the outer ring whose walls have no window.
    """
    plan = [np.asarray(ring, dtype=np.float64) for ring in rings]
    pieces = []
    for number, ring in enumerate(plan):
        for edge, (start, end) in enumerate(zip(ring, np.roll(ring, -1, axis=0), strict=True)):
            windows = None if number == 0 and edge in blank else facade
            pieces.append(_wall(start, end, low, high, windows))
    return _welded([*pieces, *_caps(plan, low, high)])


def rectangle(width: float, depth: float, x: float = 0.0, z: float = 0.0) -> FloatArray:
    """A ring around (x, z); its edges face +z, +x, -z and -x."""
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return signs * [width / 2.0, depth / 2.0] + [x, -z]


def _wall(
    start: FloatArray, end: FloatArray, low: float, high: float, facade: Facade | None
) -> Part:
    """From ``start`` to ``end`` of the plan, seen from outside from left to right."""
    along = end - start
    length = float(np.hypot(*along))
    along = along / length
    columns, rows, recess = np.empty((0, 2)), np.empty((0, 2)), 0.0
    if facade:
        columns, recess = facade.columns(length), facade.recess
        rows = np.array([row for row in facade.rows if row[1] <= high - low - 0.3]).reshape(-1, 2)
    points, faces = _panel(columns, rows, length, high - low, recess)
    across, up, inwards = points.T
    x, y = start[:, None] + np.outer(along, across) - np.outer([along[1], -along[0]], inwards)
    vertices = np.stack([x, up + low, -y], axis=1)
    vertices[:4] = [[*start, low], [*end, low], [*end, high], [*start, high]]
    vertices[:4] = vertices[:4, [0, 2, 1]] * [1.0, 1.0, -1.0]  # the same bits as in its neighbours
    return Part(vertices, faces)


def _panel(
    columns: FloatArray, rows: FloatArray, width: float, height: float, recess: float
) -> tuple[FloatArray, NDArray[np.int32]]:
    """Points (across, up, inwards), the four corners first, and counter-clockwise triangles.

    Each crossing of window edges is a corner of one window, and stands twice: in the wall and at
    the glass.
    """
    corners = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], np.float64)
    if columns.size == 0 or rows.size == 0:
        return corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    u, v = columns.ravel(), rows.ravel()
    grid = np.stack([*np.meshgrid(u, v, indexing="ij"), np.zeros((len(u), len(v)))], axis=-1)
    wall = grid.reshape(-1, 3)
    place = 4 + np.arange(len(wall)).reshape(len(u), len(v))
    deep = place + len(wall)
    a, b, c, d = place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]
    odd = np.ones(a.shape, dtype=np.bool_)
    odd[::2, ::2] = False
    faces = [_quads(*(corner[odd] for corner in (a, b, c, d)))]
    around = [place[::2, ::2], place[1::2, ::2], place[1::2, 1::2], place[::2, 1::2]]
    behind = [deep[::2, ::2], deep[1::2, ::2], deep[1::2, 1::2], deep[::2, 1::2]]
    faces.append(_quads(*behind))
    for side in range(4):
        after = (side + 1) % 4
        faces.append(_quads(around[side], around[after], behind[after], behind[side]))
    ends = [place[:, 0], place[-1, :], place[::-1, -1], place[0, ::-1]]
    for corner, row in enumerate(ends):
        faces += [triples(corner, row[1:], row[:-1]), triples(corner, (corner + 1) % 4, row[-1:])]
    points = np.concatenate([corners, wall, wall + np.array([0.0, 0.0, recess])])
    return points, np.concatenate(faces).astype(np.int32)


def _quads(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> NDArray[np.int64]:
    a, b, c, d = (np.ravel(corner) for corner in (a, b, c, d))
    return np.concatenate([triples(a, b, c), triples(a, c, d)])


def _caps(plan: Sequence[FloatArray], low: float, high: float) -> list[Part]:
    """Floor and roof."""
    points = np.concatenate(plan)
    ends = np.cumsum([len(ring) for ring in plan]).astype(np.uint32)
    faces = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3).astype(np.int32)
    edges = points[faces[:, 1:]] - points[faces[:, :1]]
    turned = edges[:, 0, 0] * edges[:, 1, 1] < edges[:, 0, 1] * edges[:, 1, 0]
    faces[turned] = faces[turned, ::-1]
    at = [np.stack([points[:, 0], np.full(len(points), y), -points[:, 1]], 1) for y in (low, high)]
    return [Part(at[0], faces[:, ::-1]), Part(at[1], faces)]


def _welded(pieces: Sequence[Part]) -> Part:
    """One part in which equal vertices are one; float32 numbers, so that any file keeps them."""
    whole = joined(pieces)
    rounded = whole.vertices.astype(np.float32).astype(np.float64) + 0.0
    vertices, place = np.unique(rounded, axis=0, return_inverse=True)
    return Part(vertices, place.reshape(-1)[whole.faces].astype(np.int32))
