"""Part: a closed piece of a generated scene, made by giving thickness to a flat shape.

The flat shape is cut into triangles without T-junctions first, so whatever is made of it (a wall
with windows, a floor with a stairwell, a wall bent to a tower) is closed to the last bit.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.section import Loop

Span = tuple[float, float]
"""Lowest and highest y of a trapezoid on one of its upright sides."""


@dataclass(frozen=True, eq=False)
class Part:
    """``vertices`` (n, 3) float64, metres, and ``faces`` (m, 3) int32 of closed pieces.

    Closed: every edge is run along as often in one direction as in the other.  Wound outwards.
    """

    vertices: FloatArray
    faces: IntArray

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Part:
        """The part shifted by that many metres."""
        return Part(self.vertices + np.array([x, y, z]), self.faces)

    def turned(self, quarters: int) -> Part:
        """Quarter turns about +y: what faced +z faces +x after one, -z after two."""
        x, y, z = self.vertices.T
        for _ in range(quarters % 4):
            x, z = z, -x
        return Part(np.stack([x, y, z], axis=1), self.faces)


def joined(parts: Iterable[Part]) -> Part:
    """All pieces as one part, in order."""
    pieces = list(parts)
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    faces = [piece.faces + start for piece, start in zip(pieces, starts[:-1], strict=True)]
    return Part(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate(faces).astype(np.int32),
    )


def thickened(front: FloatArray, back: FloatArray, triangles: IntArray) -> Part:
    """The sheet ``front`` (n, 3), the same sheet at ``back``, and a strip around their border.

    ``triangles`` (m, 3) are counter-clockwise seen from the front.
    """
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    count = len(front)
    keys = ends.astype(np.int64) @ np.array([[count, 1], [1, count]])
    a, b = ends[~np.isin(keys[:, 0], keys[:, 1])].T
    strip = [triples(b, a, a + count), triples(b, a + count, b + count)]
    faces = np.concatenate([triangles, triangles[:, ::-1] + count, *strip])
    return Part(np.concatenate([front, back]), faces.astype(np.int32))


def triples(a: ArrayLike, b: ArrayLike, c: ArrayLike) -> NDArray[np.int64]:
    """Faces (m, 3) from their corners, each (m,) or one number."""
    return np.stack(np.broadcast_arrays(a, b, c), axis=1).astype(np.int64)


def triangulated(rings: Sequence[Loop], breaks: ArrayLike = ()) -> tuple[FloatArray, IntArray]:
    """(points (n, 2), counter-clockwise triangles (m, 3)) of an outer ring with holes.

    The shape is cut at the x of every corner and of ``breaks`` into columns of trapezoids, and each
    trapezoid into triangles between all points on its left side and all on its right.  The rings'
    winding does not matter.  Coordinates are rounded to a tenth of a millimetre first, so that
    corners meant to lie above each other do.
    """
    edges = _edges(rings)
    cuts = np.unique(np.concatenate([edges[:, 0], edges[:, 2], np.round(np.asarray(breaks), 4)]))
    columns = [_trapezoids(edges, a, b) for a, b in itertools.pairwise(cuts)]
    number = _numbered(columns)
    heights = [[y for cut, y in number if cut == k] for k in range(len(cuts))]
    triangles: list[tuple[int, int, int]] = []
    for k, pieces in enumerate(columns):
        for left, right in pieces:
            triangles += _zipped(
                [number[k, y] for y in heights[k] if left[0] <= y <= left[1]],
                [number[k + 1, y] for y in heights[k + 1] if right[0] <= y <= right[1]],
            )
    points = np.array([(cuts[k], y) for k, y in number])
    return points, np.array(triangles, dtype=np.int32)


def _edges(rings: Sequence[Loop]) -> FloatArray:
    """(e, 4) x, y of the left end and of the right end of every edge that is not upright."""
    starts = np.concatenate([np.round(ring, 4) for ring in rings])
    ends = np.concatenate([np.round(np.roll(ring, -1, axis=0), 4) for ring in rings])
    swap = (starts[:, 0] > ends[:, 0])[:, None]
    edges = np.hstack([np.where(swap, ends, starts), np.where(swap, starts, ends)])
    return np.asarray(edges[edges[:, 0] < edges[:, 2]])


def _trapezoids(edges: FloatArray, left: float, right: float) -> list[tuple[Span, Span]]:
    """The pieces of the shape between two neighbouring cuts, from the bottom up."""
    across = edges[(edges[:, 0] <= left) & (edges[:, 2] >= right)]
    ends = sorted(zip(_heights(across, left), _heights(across, right), strict=True), key=sum)
    return [
        ((low[0], high[0]), (low[1], high[1]))
        for low, high in zip(ends[0::2], ends[1::2], strict=True)
    ]


def _heights(edges: FloatArray, x: float) -> list[float]:
    """y of each edge at ``x``: the same bits for both columns that meet there."""
    x0, y0, x1, y1 = edges.T
    inner = y0 + (y1 - y0) * ((x - x0) / (x1 - x0))
    y: list[float] = np.where(x == x0, y0, np.where(x == x1, y1, inner)).tolist()
    return y


def _numbered(columns: Sequence[Sequence[tuple[Span, Span]]]) -> dict[tuple[int, float], int]:
    """Index of every point (cut, y), by cut and then upwards."""
    places = {
        (k + side, y)
        for k, pieces in enumerate(columns)
        for piece in pieces
        for side in (0, 1)
        for y in piece[side]
    }
    return {place: index for index, place in enumerate(sorted(places))}


def _zipped(left: Sequence[int], right: Sequence[int]) -> list[tuple[int, int, int]]:
    """Triangles between two upright rows of points, given from the bottom up.

    The row that has come less far, as a share of its points, takes the next step.
    """
    triangles = []
    i = j = 0
    while i + j < len(left) + len(right) - 2:
        if i * (len(right) - 1) < j * (len(left) - 1) or j == len(right) - 1:
            triangles.append((left[i], right[j], left[i + 1]))
            i += 1
        else:
            triangles.append((left[i], right[j], right[j + 1]))
            j += 1
    return triangles
