"""Surface -> few triangles: decimated to a budget, then moved into the room.

Triangles that leave it are moved into it, as they are, as far as that goes.

Voxels -> shares: a solid in few cells, for work that need not be as fine as its grid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray, have_area
from simplifier.geometry.room import Room
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.decimate import decimate, mark_outline
from simplifier.kernels.fitting import fit
from simplifier.kernels.sinking import sink
from simplifier.refinement.containment import are_inside
from simplifier.refinement.fields import GAUSSIAN, Field, depths_in, smoothed

Surface = tuple[FloatArray, IntArray]
"""Vertices (n, 3) float64 and faces (m, 3) int32."""


@dataclass(frozen=True)
class Manner:
    """What a collapse costs beside its error, as :func:`~simplifier.kernels.decimate.decimate` has
    it."""

    to_middle: float
    short: float
    firm: float = 0.0
    """Firmness of the outline of a sheet, in longest edges of its box."""


EVEN = Manner(1e-3, 1e-3)
"""Triangles of even shape, which searches can move."""

CLOSE = Manner(1e-6, 1e-5)
"""As near to the surface as it gets, for what stays as it is."""

FIRM = (replace(CLOSE, firm=0.5), replace(CLOSE, firm=4.0))
"""The same of a sheet with an outline: the firmer that is, the fewer triangles are left for the
sheet within it."""


def decimate_into(vertices: FloatArray, faces: IntArray, room: Room, budget: int) -> Surface:
    """At most ``budget`` (1 or more) triangles of even shape near a surface; grid space.

    ``vertices`` (n, 3), ``faces`` (m, 3) with no vertex twice in a face and no face twice.
    Faces keep to the ``room`` where they can; those that do not share no vertex with others, so
    that the caller may shrink or drop them.

    Returns ``vertices`` (k, 3) float64, all used and none outside the room's cells, and ``faces``
    int32, none without area.
    """
    return moved_into(*decimated(vertices, faces, room, budget), room)


def decimated(
    vertices: FloatArray,
    faces: IntArray,
    room: Room,
    budget: int,
    manner: Manner = EVEN,
    outline: BoolArray | None = None,
) -> Surface:
    """As of :func:`decimate_into`, but in the place of the room and not moved into it.

    ``outline``  (n,) the vertices of a border that the ``manner`` has firm; none by default.
    """
    points = np.ascontiguousarray(vertices + room.margin, dtype=np.float64)
    corners = np.array(faces, dtype=np.int32)
    alive = np.ones(len(corners), dtype=np.bool_)
    if len(corners) > budget:
        if outline is None:
            outline = np.zeros(len(points), dtype=np.bool_)
        firmness = manner.firm * float(np.ptp(points, axis=0).max())
        decimate(
            points, corners, room.voxels, budget, alive, manner.to_middle, manner.short, outline,
            firmness,
        )  # fmt: skip
    return _without_unused(points, corners[alive])


def moved_into(points: FloatArray, corners: IntArray, room: Room) -> Surface:
    """What :func:`decimated` gave, as :func:`decimate_into` says."""
    points = np.clip(sunk(points, corners, room), 0.0, np.array(room.shape, np.float64))
    points, corners = _detach(points, corners[have_area(points[corners])], room)
    return points - room.margin, corners


def keeps_to(surface: Surface, room: Room) -> bool:
    """Whether all of a surface in grid space is within the room."""
    points, corners = surface
    return bool(are_inside((points + room.margin)[corners], room).all())


def fitted_into(points: FloatArray, corners: IntArray, room: Room) -> Surface:
    """The same as :func:`moved_into`, by corners that go one at a time where more of the faces
    around each are inside: those stay together, and go further from the surface."""
    points = points.copy()
    fit(points, corners, room.voxels, *_depth(room), _FITS, _TURNS)
    points, corners = _detach(points, corners[have_area(points[corners])], room)
    return points - room.margin, corners


def outline_of(surface: Surface) -> BoolArray:
    """(n,) vertices of a border around all of a surface, as of a terrain; of others none."""
    points, corners = surface
    outline = np.empty(len(points), dtype=np.bool_)
    mark_outline(points, corners, outline)
    return outline


def _detach(points: FloatArray, faces: IntArray, room: Room) -> tuple[FloatArray, IntArray]:
    """Give the faces that are outside vertices of their own: mending them leaves the others be."""
    inside = are_inside(points[faces], room)
    outside = faces[~inside]
    apart = faces.copy()
    apart[~inside] = len(points) + np.arange(outside.size).reshape(-1, 3)
    return _without_unused(np.concatenate([points, points[outside].reshape(-1, 3)]), apart)


def _without_unused(points: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    used, renumbered = np.unique(faces, return_inverse=True)
    return points[used], np.ascontiguousarray(renumbered.reshape(-1, 3), dtype=np.int32)


_STEPS = 48
_STEP = 0.25  # cells
_FITS = np.array([0.5, 1.0, 2.0, 0.25])  # cells that corners go to fit, and in how many turns each
_TURNS = 2


def sunk(vertices: FloatArray, faces: IntArray, room: Room) -> FloatArray:
    """Vertices (n, 3) of the step at which most faces keep to the room.

    In each of 48 steps the vertices of the faces that are outside go a quarter of a cell to where
    the nearest cell without room is further from the faces' centres.  A chord across a
    hollow sinks that way; shrinking it instead would open its neighbours.  The vertices are in the
    space of the room.
    """
    moved, best = vertices.copy(), vertices
    inside = are_inside(moved[faces], room)
    most = int(inside.sum())
    if most == len(faces):
        return best
    depth, size = _depth(room)
    ways = np.empty_like(moved)
    for _ in range(_STEPS):
        sink(moved, faces, inside, depth, size, ways, _STEP)
        inside = are_inside(moved[faces], room)
        if int(inside.sum()) > most:
            most, best = int(inside.sum()), moved.copy()
        if most == len(faces):
            break
    return best


def _depth(room: Room) -> tuple[Field, int]:
    """How far it is to the cells without room, smoothed, so not exact; and a cell's edge in voxels.

    Kept as long as the room is, which several surfaces are moved into.
    """
    known = _DEPTHS.get(room)
    if known is None:
        shares, size = coarse(room.cells)
        known = _DEPTHS[room] = smoothed(depths_in(shares > 0.5), GAUSSIAN, "symmetric"), size
    return known


_DEPTHS: WeakKeyDictionary[Room, tuple[Field, int]] = WeakKeyDictionary()

_CELLS = 64  # along the longest edge, about


def coarse(inside: BoolArray | NDArray[np.uint8]) -> tuple[NDArray[np.float64], int]:
    """(nx, ny, nz) voxels to the means of larger cells, and a cell's edge in voxels.

    A cell is a voxel in grids of up to 95 a side.  Cells at the upper ends may reach past the grid,
    which counts as outside.
    """
    size = max(1, round(max(inside.shape) / _CELLS))
    if size == 1:
        return inside.astype(np.float64), 1
    padded = np.pad(inside, [(0, -n % size) for n in inside.shape])
    nx, ny, nz = (n // size for n in padded.shape)
    blocks = padded.reshape(nx, size, ny, size, nz, size)
    return np.asarray(blocks.mean(axis=(1, 3, 5), dtype=np.float64)), size
