"""Shares of cells -> surface: the smoothed boundary of the solid.

Surface nets (Gibson, "Constrained Elastic Surface Nets", 1998) in their dual form: a vertex for
each cube between eight cells that the surface passes, at the mean of its crossings with the edges,
and a quadrilateral for each edge that it crosses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.room import WHOLE
from simplifier.geometry.solid import BoolArray
from simplifier.refinement.decimate import coarse

_LEVEL = 0.5  # of the smoothed solid: flat sides stay where they are, edges are rounded inwards
_PASSES = 2  # of smoothing, each a cell wide: the steps between voxels go, parts of two cells stay
_PAD = _PASSES  # cells around: the smoothed solid is below the level at the border

Cells = NDArray[np.int64]


def inner_surface(shares: NDArray[np.uint8]) -> tuple[FloatArray, IntArray]:
    """Triangles around the solid, wound outwards; in the space of the array.

    ``shares`` (nx, ny, nz) uint8: of each cell, what is inside, as a :class:`Room` has it.
    Returns ``vertices`` (n, 3) float64 and ``faces`` (m, 3) int32, closed.  Each vertex lies within
    three cells along every axis of the centre of a cell that the solid reaches, and of one that it
    does not fill.  Cells are voxels, or cubes of several in large grids.  Parts of one cell's
    thickness vanish.
    """
    field, size = coarse(shares)
    field = np.pad(field / WHOLE, _PAD)
    for _ in range(_PASSES):
        for axis in range(3):
            field = ndimage.convolve1d(field, [0.25, 0.5, 0.25], axis=axis, mode="constant")
    vertices, faces = _surface_nets(field - _LEVEL)
    return (vertices - _PAD + 0.5) * size, faces


@dataclass(frozen=True, eq=False)
class _Crossings:
    """Edges of one axis between neighbours of which one is inside.

    ``cells`` (q, 3) the lower end, ``points`` (q, 3) float64 where the surface is, ``rising`` (q,)
    bool where the upper end is the one inside.
    """

    axis: int
    cells: Cells
    points: FloatArray
    rising: BoolArray

    def around(self) -> Cells:
        """(4, q, 3) the cubes around each edge, counter-clockwise about the axis."""
        step = np.zeros((4, 3), np.int64)
        step[:, (self.axis + 1) % 3] = (-1, 0, 0, -1)
        step[:, (self.axis + 2) % 3] = (-1, -1, 0, 0)
        return np.asarray(self.cells[None] + step[:, None])


def _surface_nets(field: NDArray[np.float64]) -> tuple[FloatArray, IntArray]:
    """The surface where ``field``, no more than 0 at the border, passes 0; in cell indices."""
    crossings = [_crossings(field, axis) for axis in range(3)]
    shape = field.shape
    places = [
        np.ravel_multi_index(tuple(np.moveaxis(found.around(), -1, 0)), shape)
        for found in crossings
    ]
    every = np.concatenate([place.ravel() for place in places])
    points = np.concatenate([np.tile(found.points, (4, 1)) for found in crossings])
    counts = np.bincount(every, minlength=field.size)
    used = counts > 0
    sums = [np.bincount(every, points[:, axis], field.size)[used] for axis in range(3)]
    numbers = (np.cumsum(used) - 1).astype(np.int32)
    quads = [
        np.where(found.rising, numbers[place][::-1], numbers[place])
        for found, place in zip(crossings, places, strict=True)
    ]
    a, b, c, d = np.concatenate(quads, axis=1)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack(sums, axis=1) / counts[used][:, None], np.ascontiguousarray(faces)


def _crossings(field: NDArray[np.float64], axis: int) -> _Crossings:
    ahead = tuple(slice(1, None) if i == axis else slice(None) for i in range(3))
    behind = tuple(slice(None, -1) if i == axis else slice(None) for i in range(3))
    inside = field > 0.0
    crossed = inside[behind] != inside[ahead]
    low, high = field[behind][crossed], field[ahead][crossed]
    cells = np.argwhere(crossed)
    points = cells.astype(np.float64)
    points[:, axis] += low / (low - high)
    return _Crossings(axis, cells, points, inside[ahead][crossed])
