"""Occluders to refine from that are not made of planar sections.

A decimated surface covers a solid from all sides where the budget is large; sections hide more with
few triangles.  Which is better is for the measure to say: the search refines from several.

Large meshes are first reduced to one vertex a cell (Rossignac and Borrel, 1993), and vertices at
one place are welded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.room import WHOLE, Room
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.thin import border_places, crack_triangles, sum_up_cells, whole_faces
from simplifier.kernels.threads import run_each
from simplifier.refinement.decimate import (
    CLOSE,
    FIRM,
    Manner,
    Surface,
    coarse,
    decimate_into,
    decimated,
    fitted_into,
    keeps_to,
    moved_into,
    outline_of,
)
from simplifier.refinement.fields import smoothed
from simplifier.refinement.reduce import first_faces, reduce_to
from simplifier.refinement.search import pull_into


class Surfaces:
    """What searches may begin with that is not cut: the solid's surface, and the mesh itself.

    ``shown`` is what pictures show of the mesh, world units; ``grid`` that of the solid, which is
    a ``sheet`` or not; ``room`` the widest that triangles are to keep to.
    """

    def __init__(
        self, shown: TriangleMesh, grid: VoxelGrid, room: Room, *, sheet: bool = False
    ) -> None:
        self._shown, self._grid, self._room, self._sheet = shown, grid, room, sheet
        self._reduced: dict[int, tuple[Surface, BoolArray]] = {}
        self._fine: dict[tuple[int, int], list[FloatArray]] = {}

    @property
    def few(self) -> bool:
        """Whether what is shown is so few triangles that all of them are decimated."""
        return len(self._shown.faces) <= _MOST_FINE

    @cached_property
    def outlined(self) -> bool:
        """Whether a border is around all of what is shown, as of a terrain."""
        return bool(outline_of(self._clusters).any())

    @property
    def terrain_like(self) -> bool:
        """Whether it surely is a sheet, of many triangles, and outlined."""
        many = len(self._shown.faces) > _LEAST_TERRAIN
        return self._sheet and many and max(self._grid.shape) >= _SURE and self.outlined

    def of_solid(self, budget: int, room: Room) -> FloatArray:
        """The solid's surface: a soup (m, 3, 3) in the place of the ``room``, m at most the
        budget."""
        return _pulled(*enclosed_start(room, budget), room)

    def of_mesh(self, budget: int, room: Room) -> FloatArray:
        """The same of the mesh, by way of cells of voxels; of what is like a terrain by way of what
        it was reduced to."""
        surface = self.reduced(budget)[0] if self.terrain_like else self._clusters
        return _pulled(*decimate_into(*surface, room, budget), room)

    @cached_property
    def _clusters(self) -> Surface:
        """Which are decimated to any number of triangles."""
        return cluster_vertices(self._shown, self._grid)

    def fine(self, budget: int, rooms: Sequence[Room], *, fitted: bool = False) -> list[FloatArray]:
        """The mesh in fewer triangles, as thin as pictures show it, in each room: made once.

        ``fitted``  whether a sheet that would have holes is fitted into the room as well.
        """
        left = {room.limit: room for room in rooms if (budget, room.limit) not in self._fine}
        if left:
            reduced = self.reduced(budget)
            made = fine_starts(*reduced, list(left.values()), budget, fitted=fitted)
            for room, some in zip(left.values(), made, strict=True):
                self._fine[budget, room.limit] = [_pulled(*one, room) for one in some]
        return [one for room in rooms for one in self._fine[budget, room.limit]]

    def reduced(self, budget: int) -> tuple[Surface, BoolArray]:
        """The surface in grid space that :meth:`fine` decimates, and its outline: made once.

        It is of as few triangles as decimate soon, which takes one thread half of the time of
        :meth:`fine`.  Of what is like a terrain it has so few that each of its several starts takes
        next to no time.
        """
        if budget not in self._reduced:
            shown = self._shown
            if not self.few:
                shown = reduce_to(shown, min(max(_FOR_EACH * budget, _LEAST_FINE), _MOST_FINE))
            surface = weld_vertices(shown, self._grid)
            outline = outline_of(surface)
            if outline.any() and self.terrain_like:
                left = max(_LEAST_TERRAIN, _FOR_EACH_OF_TERRAIN * budget)
                points, faces = decimated(*surface, self._room, left, FIRM[0], outline)
                surface = points - self._room.margin, faces
                outline = outline_of(surface)
            self._reduced[budget] = surface, outline
        return self._reduced[budget]


def _pulled(vertices: FloatArray, faces: IntArray, room: Room) -> FloatArray:
    return pull_into(vertices[faces] + room.margin, room)


def enclosed_start(room: Room, budget: int) -> tuple[FloatArray, IntArray]:
    """The solid's smoothed surface in at most ``budget`` triangles, for what encloses a volume.

    Returns vertices (n, 3) float64 in grid space and faces (m, 3) int32, m at most the budget and
    0 where the solid is nowhere thicker than a voxel.
    """
    vertices, faces = inner_surface(room.shares)
    return decimate_into(vertices - room.margin, faces, room, budget)


def fine_starts(
    surface: Surface,
    outline: BoolArray,
    rooms: Sequence[Room],
    budget: int,
    *,
    fitted: bool = False,
) -> list[list[Surface]]:
    """A surface in at most ``budget`` triangles, thinner than a voxel as it may be: one for each
    room, several of a sheet with an ``outline`` (n,), which :func:`~.decimate.outline_of` finds.
    A sheet of which some leaves the room once moved into it would have holes, so it is ``fitted``
    into it as well.

    The ``rooms`` are one, each up to another limit; the surface is in grid space.

    Results as of :func:`enclosed_start`.  The cells of :func:`cluster_vertices` leave nothing of a
    thin rod, or a ribbon that is too wide.
    """
    manners = FIRM if outline.any() else (CLOSE,)
    ways = [(room, manner) for room in rooms for manner in manners]

    def begin(way: tuple[Room, Manner]) -> list[Surface]:
        room, manner = way
        fewer = decimated(*surface, room, budget, manner, outline)
        made = [moved_into(*fewer, room)]
        if fitted and outline.any() and not keeps_to(made[0], room):
            made.append(fitted_into(*fewer, room))
        return made

    made = run_each(begin, ways)
    of_rooms = [made[first : first + len(manners)] for first in range(0, len(made), len(manners))]
    return [list(chain.from_iterable(some)) for some in of_rooms]


_FOR_EACH = 320  # triangles that one of a start stands for, where that is within the next two
_LEAST_FINE, _MOST_FINE = 10_000, 20_000  # the latter take a fiftieth of a second
_FOR_EACH_OF_TERRAIN, _LEAST_TERRAIN = 8, 1_000  # the same of what is like a terrain


_CELLS = 64  # along the longest edge, at most: what is finer only costs time
_SURE = 32  # voxels along the longest edge: in fewer whatever is hollow may seem a sheet


def cluster_vertices(mesh: TriangleMesh, grid: VoxelGrid) -> tuple[FloatArray, IntArray]:
    """The mesh with all vertices in a cell moved to their mean, for open sheets and thin parts.

    Cells are voxels, or cubes of several in grids of more than 64 a side.  Returns ``vertices``
    (n, 3) float64 in grid space, each within a cell's diagonal of those that it stands for, and
    ``faces`` (m, 3) int32 in the order of the input: those that keep three different vertices, once
    each.  Cracks that open at T-junctions are filled by more faces behind them.
    """
    size = max(1.0, max(grid.shape) / _CELLS)
    shape = np.ceil(np.array(grid.shape) / size).astype(np.int64)
    steps = np.array([shape[1] * shape[2], shape[2], 1])
    place, counts, sums = sum_up_cells(
        mesh.vertices, grid.origin, grid.cell_size, size, shape, steps
    )
    vertices = sums / counts[:, None]
    faces = _once(whole_faces(mesh.faces, place), len(vertices))
    border = border_places(faces, len(vertices))
    if border.any():
        within = grid.to_grid(mesh.vertices)
        within /= size
        for axis, end in enumerate(np.nextafter(shape, 0.0)):
            # What rounding puts past the grid belongs to its last cells.
            np.clip(within[:, axis], 0.0, end, out=within[:, axis])
        numbers = np.zeros(shape, dtype=np.int32)
        numbers[tuple(within.astype(np.int32).T)] = place + 1
        cracks = crack_triangles(within, np.zeros(3), 1.0, mesh.faces, place, numbers, border)
        if len(cracks):
            a, b, c = (closing := place[cracks]).T
            closing = closing[(a != b) & (b != c) & (c != a)]
            faces = _once(np.concatenate([faces, closing]), len(vertices))
    return vertices, faces


def _once(faces: IntArray, vertices: int) -> IntArray:
    """Those with the same corners once, the first of them, in their order."""
    return np.ascontiguousarray(faces[np.sort(first_faces(faces, vertices))])


def weld_vertices(mesh: TriangleMesh, grid: VoxelGrid) -> tuple[FloatArray, IntArray]:
    """``vertices`` (n, 3) float64 in grid space and ``faces`` (m, 3) int32 in the input's order.

    Exact, unlike :func:`cluster_vertices`: only what coincides is joined.  Of a mesh of 2 million
    vertices at most.
    """
    x, y, z = mesh.vertices.T
    order = np.lexsort((z, y, x))
    points = mesh.vertices[order]
    first = np.ones(len(points), dtype=np.bool_)
    first[1:] = (points[1:] != points[:-1]).any(axis=1)
    place = np.empty(len(points), dtype=np.int32)
    place[order] = np.cumsum(first, dtype=np.int32) - 1
    points = points[first]
    return grid.to_grid(points), _once(place[mesh.faces], len(points))


_LEVEL = 0.5  # of the smoothed solid: flat sides stay where they are, edges are rounded inwards
_PASSES = 2  # of smoothing, each a cell wide: the steps between voxels go, parts of two cells stay
_PAD = _PASSES  # cells around: the smoothed solid is below the level at the border

Cells = NDArray[np.int64]


def inner_surface(shares: NDArray[np.uint8]) -> tuple[FloatArray, IntArray]:
    """Triangles around the solid's smoothed boundary, wound outwards; in the space of the array.

    Surface nets (Gibson, "Constrained Elastic Surface Nets", 1998) in their dual form: a vertex for
    each cube between eight cells that the surface passes, at the mean of its crossings with the
    edges, and a quadrilateral for each edge that it crosses.

    ``shares`` (nx, ny, nz) uint8: of each cell, what is inside, as a :class:`Room` has it.
    Returns ``vertices`` (n, 3) float64 and ``faces`` (m, 3) int32, closed.  Each vertex lies within
    three cells along every axis of the centre of a cell that the solid reaches, and of one that it
    does not fill.  Cells are voxels, or cubes of several in large grids.  Parts of one cell's
    thickness vanish.
    """
    field, size = coarse(shares)
    field = np.pad(field / WHOLE, _PAD)
    for _ in range(_PASSES):
        field = smoothed(field, (0.5, 0.25), "constant")
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
