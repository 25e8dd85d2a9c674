"""UprightScene -> Slices: what lines of sight cannot pass, in planes across the three axes.

A slice is a picture of a plane: pixels that closed pieces of the mesh cover together, by parity, or
triangles that lie in the plane.  A line that crosses the plane in such a pixel, from a point in no
closed piece, crosses a triangle on the way or there.  It takes nothing solid to both sides: a pane
hides if a slice runs in it.  There is one through the middle of each layer of voxels, one within
each slab between flat faces that is thinner, and one in each larger flat face of an open sheet.

Pieces that touch each other leave nothing between them.  A pixel is covered if lines through it are
along both axes, those along its edges included.  So a crack is found however narrow it is, if it is
half a pixel long; holes that are smaller both ways are not, and count as closed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.slices import SAME, cover_slices
from simplifier.kernels.threads import run_chunks
from simplifier.visibility.slices.sheets import Sheets
from simplifier.visibility.solid.closed_pieces import closed_pieces, floor_of, without_halls

AXES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
"""For each axis u of slices, those along their pixels, v and w."""

_SHIFT = 0.3819660113  # voxels that the grid begins before the scene
_MOVED = 0.45  # voxels that an edge of pixels is moved at most
_LEAST = 25.0  # pixels: smaller faces get no slice of their own

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Grid:
    """Cubes, upright: ``origin`` (3,) float64, ``cell`` the edge, ``shape`` (3,) int64."""

    origin: FloatArray
    cell: float
    shape: Ids

    @classmethod
    def around(cls, upright: UprightScene, cell: float) -> Grid:
        origin = np.full(3, -(1.0 + _SHIFT) * cell)
        return cls(origin, cell, np.floor((upright.extent - origin) / cell).astype(np.int64) + 2)

    def to_grid(self, points: FloatArray) -> FloatArray:
        """Upright points (…, 3) in voxels."""
        return np.asarray((points - self.origin) / self.cell)


@dataclass(frozen=True, eq=False)
class Slices:
    """What hides.

    ``ats``      for each axis (m,) float64, ascending: where its slices are, voxels.
    ``covered``  for each axis (m, nv, nw) bool: see :data:`AXES`.
    ``edges``    for each axis (n + 1,) float64, ascending: of the pixels along it, less than half a
                 voxel from those of the grid.  There are some along larger flat faces, so that what
                 ends there fills its pixels.
    ``lost``     share of the scene's surface that is in no slice: neither of closed pieces, nor
                 flat across an axis.
    ``halls``    closed pieces that are not solid, since viewers are in them.
    """

    grid: Grid
    ats: tuple[FloatArray, FloatArray, FloatArray]
    covered: tuple[BoolArray, BoolArray, BoolArray]
    edges: tuple[FloatArray, FloatArray, FloatArray]
    lost: float
    halls: int
    sheets: Sheets


def slices_of(opaque: UprightScene, grid: Grid, viewers: ViewCells) -> Slices:
    """The slices of what hides anything.

    ``viewers``  where they are.  If that is nowhere below 0, what stands open on the lowest plane
                 of the scene is closed by it.  A closed piece that they are in is not solid, and
                 counts as open (``without_halls`` of ``closed_pieces.py``).
    """
    points, faces = _soup(opaque)
    found, halls = _pieces(points, faces, grid, viewers)
    lost = _lost(points, faces, found, grid)
    numbers = np.unique(found, return_inverse=True)[1].reshape(-1) - int((found < 0).any())
    pieces = np.where(found < 0, -1, numbers).astype(np.int32)
    faces, pieces = _with_bases(points, faces, pieces)
    areas = _areas(points, faces)
    scaled = grid.to_grid(points)
    sheets = Sheets.of(scaled, faces[pieces < 0])
    flat = [_Flat.of(scaled[faces, axis], pieces, areas / grid.cell**2) for axis in range(3)]
    edges = [_edges(one, int(count)) for one, count in zip(flat, grid.shape, strict=True)]
    ats, covered = [], []
    for axes in AXES:
        own, mask = _along_axis(scaled, faces, pieces, axes, flat[axes[0]], edges)
        ats.append(own)
        covered.append(mask)
    return Slices(
        grid, (ats[0], ats[1], ats[2]), (covered[0], covered[1], covered[2]),
        (edges[0], edges[1], edges[2]), lost, halls, sheets,
    )  # fmt: skip


def open_share(opaque: UprightScene, grid: Grid, viewers: ViewCells) -> float:
    """``lost`` of the :class:`Slices` that :func:`slices_of` would give; 1 of nothing."""
    points, faces = _soup(opaque)
    if len(faces) == 0:
        return 1.0
    return _lost(points, faces, _pieces(points, faces, grid, viewers)[0], grid)


def _pieces(
    points: FloatArray, faces: IntArray, grid: Grid, viewers: ViewCells
) -> tuple[NDArray[np.int64], int]:
    """The closed piece of each triangle, -1 for none, and how many are not solid, as halls."""
    if len(faces) == 0:
        return np.empty(0, np.int64), 0
    size = float(grid.shape.max()) * grid.cell
    closed = closed_pieces(points, faces, floor_of(viewers, size))
    found = without_halls(points, faces, closed, viewers)
    return found, len(np.unique(closed[found != closed]))


def _lost(points: FloatArray, faces: IntArray, found: NDArray[np.int64], grid: Grid) -> float:
    areas = _areas(points, faces)
    level = (np.ptp(points[faces], axis=1) <= SAME * grid.cell).any(axis=1)
    return float(areas[(found < 0) & ~level].sum() / max(areas.sum(), 1e-300))


@dataclass(frozen=True, eq=False)
class _Flat:
    """The larger flat faces across an axis.

    ``heights`` (p,) float64, ascending: their planes; ``areas`` (p,) pixels; ``sheets`` (p,) bool
    whether enough of that is of no closed piece.
    ``level``   (m,) bool: the triangles across the axis.
    """

    heights: FloatArray
    areas: FloatArray
    sheets: BoolArray
    level: BoolArray

    @classmethod
    def of(cls, corners: FloatArray, pieces: IntArray, areas: FloatArray) -> _Flat:
        """``corners`` (m, 3): coordinates of the triangles along the axis."""
        low = corners.min(axis=1, initial=np.inf)
        level = corners.max(axis=1, initial=-np.inf) - low <= SAME
        planes, place = np.unique(np.round(low[level] / SAME), return_inverse=True)
        place = place.reshape(-1)
        total = np.bincount(place, areas[level], len(planes))
        open_ = np.bincount(place, np.where(pieces[level] < 0, areas[level], 0.0), len(planes))
        heights = np.full(len(planes), np.inf)
        np.minimum.at(heights, place, low[level])
        wide = total >= _LEAST
        return cls(heights[wide], total[wide].astype(np.float64), (open_ >= _LEAST)[wide], level)


def _edges(flat: _Flat, count: int) -> FloatArray:
    """Of pixels, moved to the largest flat face nearby."""
    edges = np.arange(count + 1, dtype=np.float64)
    nearest = np.round(flat.heights).astype(np.int64)
    for place in np.argsort(flat.areas, kind="stable").tolist():
        if 0 < nearest[place] < count and abs(flat.heights[place] - nearest[place]) < _MOVED:
            edges[nearest[place]] = flat.heights[place]
    return edges


def _soup(upright: UprightScene) -> tuple[FloatArray, IntArray]:
    infinite = np.full(3, np.inf)
    batches = list(upright.triangles(-infinite, infinite))
    counts = np.cumsum([0, *(len(vertices) for vertices, _ in batches)])
    points = np.concatenate([np.empty((0, 3)), *(vertices for vertices, _ in batches)])
    faces = [one + begin for (_, one), begin in zip(batches, counts, strict=False)]
    return points, np.concatenate([np.empty((0, 3), np.int32), *faces]).astype(np.int32)


def _with_bases(points: FloatArray, faces: IntArray, pieces: IntArray) -> tuple[IntArray, IntArray]:
    """The faces, and fans over the borders that pieces have on the ground."""
    _, place = np.unique(points, axis=0, return_inverse=True)
    solid = np.flatnonzero(pieces >= 0)
    edges = np.concatenate(
        [faces[solid][:, [0, 1]], faces[solid][:, [1, 2]], faces[solid][:, [2, 0]]]
    )
    owner = np.tile(pieces[solid], 3)
    welded = np.sort(place.reshape(-1)[edges], axis=1)
    keep = welded[:, 0] != welded[:, 1]
    edges, owner, welded = edges[keep], owner[keep], welded[keep]
    keys = welded[:, 0] * np.int64(len(points)) + welded[:, 1]
    _, first, times = np.unique(keys, return_index=True, return_counts=True)
    odd = first[times % 2 == 1]
    if len(odd) == 0:
        return faces, pieces
    # All fans of a piece have the same tip: what two of them cover twice is not in it.
    _, tip, which = np.unique(owner[odd], return_index=True, return_inverse=True)
    tips = edges[odd][tip, 0][which.reshape(-1)]
    fans = np.column_stack([edges[odd], tips]).astype(np.int32)
    return np.concatenate([faces, fans]), np.concatenate([pieces, owner[odd]]).astype(np.int32)


def _areas(points: FloatArray, faces: IntArray) -> FloatArray:
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _along_axis(
    points: FloatArray, faces: IntArray, pieces: IntArray, axes: tuple[int, int, int], flat: _Flat,
    edges: list[FloatArray],
) -> tuple[FloatArray, BoolArray]:  # fmt: skip
    """Where slices across the first of the axes are, and what is covered."""
    u, v, w = (edges[axis] for axis in axes)
    turned = np.ascontiguousarray(points[:, axes])
    low = turned[faces, 0].min(axis=1, initial=np.inf)
    high = turned[faces, 0].max(axis=1, initial=-np.inf)
    slabs = (0.5 * (flat.heights[1:] + flat.heights[:-1]))[np.diff(flat.heights) < 1.0]
    ats = np.unique(np.concatenate([0.5 * (u[1:] + u[:-1]), flat.heights[flat.sheets], slabs]))
    solid = pieces >= 0
    starts, listed = _by_slice(low, high, solid & ~flat.level, ats)
    flat_starts, flat_listed = _by_slice(low - SAME, low + SAME, flat.level & ~solid, ats)
    covered = np.zeros((len(ats), len(v) - 1, len(w) - 1), dtype=np.bool_)
    run_chunks(
        lambda begin, end: cover_slices(
            turned, faces, pieces, starts, listed, flat_starts, flat_listed, ats, v, w, begin, end,
            covered,
        ),
        len(ats), least=4, chunks_per_thread=8,
    )  # fmt: skip
    return ats, covered


def _by_slice(
    low: FloatArray, high: FloatArray, wanted: BoolArray, ats: FloatArray
) -> tuple[Ids, IntArray]:
    """The faces that reach each slice, CSR."""
    chosen = np.flatnonzero(wanted)
    first, last = np.searchsorted(ats, low[chosen]), np.searchsorted(ats, high[chosen], "right")
    lengths = last - first
    owners = np.repeat(chosen, lengths)
    rows = np.arange(len(owners)) - np.repeat(np.cumsum(lengths) - lengths - first, lengths)
    order = np.argsort(rows, kind="stable")
    counts = np.bincount(rows, minlength=len(ats))
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return starts, np.ascontiguousarray(owners[order], dtype=np.int32)
