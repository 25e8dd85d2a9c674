"""Where one can stand indoors, and a walk through rooms: over floors with headroom, under a roof or
between walls.

Floors are found as in M. Mononen's Recast: a free voxel over a touched one with enough free voxels
above it; two of them are neighbours when the step between them is low.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from simplifier.camera_paths.columns import UprightScene, window
from simplifier.camera_paths.walk import Ids, Space, Ways, crossed_cells, equal_steps, smooth, tour
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.voxelize import mark_triangles

_AWAY = 0.12  # least distance from walls and ledges, eye heights
_ROOMY = 0.6  # further from them is not better
_WIDE = 0.25  # from the walls, eye heights, that nobody gets within one
_CLOSET = 0.25  # the least floor that far from them of a room without a way out
_AREA = 4.0  # the least floor, squares of eye heights
_OPEN_AREA = 0.05  # the least floor of rooms without a roof, share of the scene: else it is a yard
_OPEN = 0.25  # what a place between walls counts for, beside one under a roof
_STEP = 3.0  # longest from frame to frame, eye heights


def interior_walk(
    upright: UprightScene, frames: int, eye: float, rng: np.random.Generator
) -> FloatArray | None:
    """(frames, 3) eyes along a walk, upright space; None where there is no interior."""
    floors = find_floors(upright.without_doors(), eye)
    if floors is None or len(floors.pairs) == 0:
        return None
    ledges = floors.ledge_distances()
    roofed, rooms = floors.indoors()
    kept = rooms & (ledges >= max(_AWAY * floors.eye, 1.0))
    pairs = _renumber(floors.pairs, kept)
    if len(pairs) == 0:
        return None
    crowded = np.maximum(0.0, 1.0 - ledges[kept] / (_ROOMY * floors.eye))
    ways = Ways.between(floors.eyes[kept], pairs, 1.0 + 3.0 * crowded)
    room = _largest(ways, np.where(roofed[kept], 1.0, _OPEN))
    if np.count_nonzero(room) < _least(floors, roofed[kept][room]):
        return None
    longest = _STEP * floors.eye
    route = tour(ways, room, 0.4 * longest * frames, rng)
    space = _space(floors, kept)
    return floors.grid.to_world(equal_steps(smooth(route, space), frames, longest, space))


def places_indoors(upright: UprightScene, eye: float) -> FloatArray:
    """(n, 3) the eyes of all who stand in rooms, world units, whether anything leads in or not."""
    floors = floors_indoors(upright, eye)
    if floors is None:
        return np.empty((0, 3))
    return upright.to_world(floors.grid.to_world(floors.eyes))


def floors_indoors(upright: UprightScene, eye: float) -> Floors | None:
    """The floors of rooms, whether anything leads in or not; None where there are none.

    What has neither a way out nor the floor of a small room is the inside of a wall or a beam.
    """
    floors = find_floors(upright.without_doors(), eye)
    if floors is None or len(floors.cells) == 0 or len(floors.pairs) == 0:
        return None
    _, walled, leads_out = floors.surroundings()
    wide = floors.ledge_distances() >= _WIDE * floors.eye
    ways = Ways.between(floors.eyes, floors.pairs, np.ones(len(floors.cells)))
    part = ways.parts()
    areas = np.bincount(part, weights=wide)
    closet = wide & (areas[part] >= _CLOSET * floors.eye**2)
    kept = walled & (leads_out | closet)
    if not kept.any():
        return None
    return replace(floors, cells=floors.cells[kept], pairs=_renumber(floors.pairs, kept))


def _least(floors: Floors, roofed: BoolArray) -> float:
    """How many places make an interior."""
    least = _AREA * floors.eye**2
    width, depth, _ = floors.grid.shape
    return least if roofed.mean() > 0.5 else max(least, _OPEN_AREA * width * depth)


def _renumber(pairs: Ids, kept: BoolArray) -> Ids:
    """The pairs of which both are kept, by their numbers among these."""
    numbers = np.cumsum(kept) - 1
    return np.asarray(numbers[pairs[kept[pairs].all(axis=1)]])


def _largest(ways: Ways, worth: FloatArray) -> BoolArray:
    """(n,) whether a place is in the connected part of the highest worth."""
    part = ways.parts()
    return np.asarray(part == np.bincount(part, weights=worth).argmax())


def _space(floors: Floors, kept: BoolArray) -> Space:
    """About the eyes of the places that are kept; grid space."""
    inside = floors.grid.inside
    about = np.zeros_like(inside)
    x, y, z = (index[kept] for index in floors.eye_voxels)
    for rise in (-1, 0, 1):
        about[x, y, np.clip(z + rise, 0, inside.shape[2] - 1)] = True
    about &= ~inside

    def allows(points: FloatArray) -> BoolArray:
        return np.asarray(about[tuple(points.astype(np.int64).T)])

    def clear(starts: FloatArray, ends: FloatArray) -> BoolArray:
        ways = [crossed_cells(a, b)[0] for a, b in zip(starts, ends, strict=True)]
        return np.array([not inside[tuple(way.T)].any() for way in ways], dtype=np.bool_)

    return Space(allows, clear)


_MOST_VOXELS = 24_000_000
_FINEST, _COARSEST = 0.06, 0.18  # a voxel's edge, eye heights
_TALLEST = 10_000.0  # eye heights; over more, a window that fits into memory holds no room
_HEADROOM = 1.1
_CLIMB = 0.2  # the highest step between neighbours, eye heights
_AROUND = ((1, 0), (0, 1), (1, 1), (1, -1))  # with their opposites all eight neighbours


@dataclass(frozen=True, eq=False)
class Floors:
    """Where one can stand, whether indoors or not.

    ``grid``   the voxels that triangles touch.
    ``cells``  (n, 3) int64: the lowest free voxel of each place.
    ``pairs``  (m, 2) int64: places that one can step between, each pair once.
    ``eye``    eye height, voxels.
    """

    grid: VoxelGrid
    cells: Ids
    pairs: Ids
    eye: float

    @property
    def eyes(self) -> FloatArray:
        """(n, 3) of the places, grid space."""
        return np.asarray(self.cells + np.array([0.5, 0.5, self.eye]))

    @property
    def eye_voxels(self) -> tuple[Ids, Ids, Ids]:
        """Indices of the voxels that hold the eyes."""
        x, y, z = self.eyes.astype(np.int64).T
        return x, y, z

    def ledge_distances(self) -> FloatArray:
        """(n,) voxels to the next wall or ledge, along the floor."""
        count = len(self.cells)
        lengths = np.linalg.norm(np.diff(self.cells[self.pairs][..., :2], axis=1)[:, 0], axis=1)
        graph = sparse.csr_array((lengths, tuple(self.pairs.T)), shape=(count, count))
        edge = np.bincount(self.pairs.ravel(), minlength=count) < 2 * len(_AROUND)
        far = csgraph.dijkstra(graph, directed=False, indices=np.nonzero(edge)[0], min_only=True)
        return np.asarray(far + 0.5)

    def indoors(self) -> tuple[BoolArray, BoolArray]:
        """(n,) whether a place has a roof, and whether it is in a room.

        A room has walls and a way out, be it a window, else it is the inside of a solid.
        """
        roofed, walled, leads_out = self.surroundings()
        return roofed, walled & leads_out

    def surroundings(self) -> tuple[BoolArray, BoolArray, BoolArray]:
        """(n,) whether a place has a roof, whether it has walls, and whether anything leads out.

        Walls are in three of the four directions of the grid where it has a roof, in all four where
        it has none.
        """
        x, y, z = self.eye_voxels
        walls = np.zeros(len(self.cells), dtype=np.int64)
        for axis in (0, 1):
            for turned in (self.grid.inside, np.flip(self.grid.inside, axis)):
                behind = np.logical_or.accumulate(turned, axis=axis)
                if turned is not self.grid.inside:
                    behind = np.flip(behind, axis)
                walls += behind[x, y, z]
        above = np.flip(np.logical_or.accumulate(np.flip(self.grid.inside, 2), axis=2), 2)
        roofed = above[x, y, z]
        spaces, _ = ndimage.label(~self.grid.inside)
        leads_out = spaces[x, y, z] == spaces[0, 0, -1]  # the uppermost voxels are all free
        return roofed, np.where(roofed, walls >= 3, walls == 4), leads_out


def find_floors(upright: UprightScene, eye: float) -> Floors | None:
    """All floors of a scene, or of the most built-up part of a large one; ``eye`` world units.

    None where the scene is too tall for eyes so low: its unit is hardly the one meant.
    """
    if upright.extent[2] > _TALLEST * eye:
        return None
    grid = _touched_voxels(upright, eye)
    eye_voxels = grid.in_voxels(eye)
    free = ~grid.inside
    stands = np.zeros_like(free)
    stands[:, :, 1:] = free[:, :, 1:] & ~free[:, :, :-1]
    for up in range(1, math.ceil(_HEADROOM * eye_voxels)):
        stands[:, :, :-up] &= free[:, :, up:]
    cells = np.argwhere(stands)
    pairs = _pairs(stands, cells, max(round(_CLIMB * eye_voxels), 1))
    return Floors(grid, cells, pairs, eye_voxels)


def _touched_voxels(upright: UprightScene, eye: float) -> VoxelGrid:
    """The voxels that triangles touch, within memory, and a headroom of free ones above all."""
    height = float(upright.extent[2]) + 2.0 * _HEADROOM * eye
    coarsest = _COARSEST * eye
    low, high = window(upright, coarsest * math.sqrt(_MOST_VOXELS * coarsest / height))
    volume = float(np.prod(high - low)) * height
    cell = max((volume / _MOST_VOXELS) ** (1.0 / 3.0), _FINEST * eye)
    # What lies on the window's edge touches the voxel past it, and one may go around in the next.
    margin = 2
    origin = np.array([*low, 0.0]) - margin * cell
    shape = np.ceil(np.array([*(high - low), height]) / cell).astype(np.int64) + 2 * margin
    touched = np.zeros(tuple(shape), dtype=np.bool_)
    top = origin + shape * cell
    for vertices, faces in upright.triangles(origin, top):
        inside = _reaching(vertices, faces, origin, top)
        # Read-only as the arrays of a mesh: else the kernel is compiled a second time.
        vertices.setflags(write=False)
        inside.setflags(write=False)
        mark_triangles(vertices, inside, origin, 1.0 / cell, 0, len(inside), touched)
    return VoxelGrid(touched, origin, cell)


def _reaching(
    points: FloatArray, faces: NDArray[np.int32], low: FloatArray, high: FloatArray
) -> NDArray[np.int32]:
    """The faces whose box reaches into a box: the voxelizer takes no others."""
    corners = points[faces]
    reach = (corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)
    return np.ascontiguousarray(faces[reach.all(axis=1)])


def _pairs(stands: BoolArray, cells: Ids, climb: int) -> Ids:
    """Places in neighbouring columns with a step of at most ``climb``; of several the lowest."""
    margin = np.array([1, 1, climb])  # of no places, so that looking around needs no checks
    numbers = np.full(tuple(stands.shape + 2 * margin), -1, dtype=np.int32)
    x, y, z = (cells + margin).T
    numbers[x, y, z] = np.arange(len(cells), dtype=np.int32)
    pairs = []
    for dx, dy in _AROUND:
        other = np.full(len(cells), -1, dtype=np.int32)
        for step in sorted(range(-climb, climb + 1), key=abs, reverse=True):
            found = numbers[x + dx, y + dy, z + step]
            other = np.where(found >= 0, found, other)
        there = np.nonzero(other >= 0)[0]
        pairs.append(np.column_stack([there, other[there]]))
    return np.concatenate(pairs).astype(np.int64)
