"""How far an occluder strays from the original: the figure that its error bound promises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import MeshError
from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.room import EVERYWHERE
from simplifier.geometry.solid import BoolArray, Solid, VoxelGrid
from simplifier.kernels.deviation import (
    build_box_tree,
    halve_pieces,
    piece_distances,
    point_distances,
    triangle_boxes,
    triangles_of_leaf,
)
from simplifier.kernels.soup_views import all_contained
from simplifier.kernels.threads import run_chunks

SLACK = 0.25
"""Voxels: the true largest distance is at most this above :func:`deviation`."""

_LARGEST_COORDINATE = 1e100  # squares stay finite
_BATCH = 16384  # pieces judged at once
_LEAST_QUERIES = 64  # fewer are not worth a hand-over to another thread


def deviation(
    occluder: Occluder, mesh: TriangleMesh, interior: VoxelGrid, voxel: float | None = None
) -> float:
    """Largest distance from a point of the occluder to the original, world units.

    The distance of a point is that to the nearest triangle of ``mesh`` or to the nearest voxel of
    the ``interior`` (0 within), whichever is less.  Points outside of the grid count too.

    Distances are exact at the points that are looked at, the occluder's corners among them; over a
    triangle, branch and bound stops when no point can be further than the result plus a quarter of
    a ``voxel`` (its edge, world units; the interior's own if None), or a share of 1e-9 of the scene
    for occluders that reach so far out.  The result is never above the true value.  Without
    triangles it is 0.

    Raises :class:`MeshError` when the occluder's coordinates are not finite or beyond 1e100 voxels.
    """
    if len(occluder.faces) == 0:
        return 0.0
    triangles = np.ascontiguousarray(interior.to_grid(occluder.vertices)[occluder.faces])
    if not (np.abs(triangles) < _LARGEST_COORDINATE).all():
        raise MeshError(
            "a coordinate is not finite or out of reach", where="occluder", remedy="repair it"
        )
    triangles = _leaving(triangles, interior.inside)
    if len(triangles) == 0:
        return 0.0
    original = _Original.of(interior.to_grid(mesh.vertices), mesh.faces, interior.bits)
    voxels = 1.0 if voxel is None else voxel / interior.cell_size
    return _largest_distance(triangles, original, SLACK * voxels) * interior.cell_size


def deviation_from_solid(occluder: Occluder, mesh: TriangleMesh, solid: Solid) -> float:
    """:func:`deviation` from a mesh and its solid's interior, to a quarter of the solid's voxel.

    What is known of the interior in finer voxels counts, but need not be looked at as finely.
    """
    return deviation(occluder, mesh, solid.interior, solid.core.cell_size)


def _leaving(triangles: FloatArray, inside: BoolArray) -> FloatArray:
    """Those that touch a voxel which is not inside; the others are at no distance at all."""
    layers = (~inside).view(np.uint8)
    within = np.empty(len(triangles), dtype=np.bool_)
    nothing_kept = np.empty((0, 0, 0), dtype=np.uint64)  # voxels are cells themselves
    all_contained(triangles, (layers, layers, layers, 0, nothing_kept, EVERYWHERE), within)
    return triangles[~within]


@dataclass(frozen=True, eq=False)
class _Original:
    """Triangles and interior boxes in grid space, each with a tree to search."""

    box_nodes: FloatArray
    nodes: FloatArray
    order: NDArray[np.int64]
    points: FloatArray
    faces: IntArray

    @classmethod
    def of(cls, points: FloatArray, faces: IntArray, interior: BitGrid) -> _Original:
        def boxes(chosen: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
            lows, highs = np.empty((2, len(chosen), 3))
            triangle_boxes(points, faces, chosen, lows, highs)
            return lows, highs

        nodes, order = build_box_tree(boxes, len(faces), triangles_of_leaf(len(faces)))
        return cls(_box_nodes(interior), nodes, order, points, faces)

    def distances(self, queries: FloatArray) -> FloatArray:
        """(n,) exact, of (n, 3) points."""
        result = np.empty(len(queries))
        tree = (self.box_nodes, self.nodes, self.order, self.points, self.faces)
        run_chunks(
            lambda a, b: point_distances(queries, *tree, a, b, result),
            len(queries),
            least=_LEAST_QUERIES,
        )
        return result

    def piece_bounds(
        self, pieces: FloatArray, largest: float, slack: float
    ) -> tuple[FloatArray, FloatArray]:
        """(distances, reaches) of (n, 3, 3) triangles; see :func:`piece_distances`."""
        distances = np.empty(len(pieces))
        reaches = np.empty(len(pieces))
        tree = (self.box_nodes, self.nodes, self.order, self.points, self.faces)
        run_chunks(
            lambda a, b: piece_distances(pieces, largest, slack, *tree, a, b, distances, reaches),
            len(pieces),
            least=_LEAST_QUERIES,
        )
        return distances, reaches


def _largest_distance(triangles: FloatArray, original: _Original, allowed: float) -> float:
    """Branch and bound over ``triangles`` (t, 3, 3), grid space.

    The distance changes by at most one unit a unit of length, so a piece can be dropped when the
    distance of its centroid plus its reach is at most the largest known plus the slack; else it is
    cut in two.  Batches of a fixed size: the largest is known to all pieces of the next one, and
    the result does not depend on threads.
    """
    # With indices, since np.unique without them loads numpy's masked arrays.
    corners, _ = np.unique(triangles.reshape(-1, 3), axis=0, return_index=True)
    largest = float(original.distances(corners).max())
    slack = max(allowed, 1e-9 * (largest + float(np.ptp(triangles))))
    waiting = [triangles]
    while waiting:
        pieces = waiting.pop()
        if len(pieces) > _BATCH:
            waiting.append(pieces[_BATCH:])
            pieces = np.ascontiguousarray(pieces[:_BATCH])
        distances, reaches = original.piece_bounds(pieces, largest, slack)
        undecided = distances > largest + slack - reaches
        largest = max(largest, float(distances[undecided].max(initial=0.0)))
        open_pieces = pieces[undecided & (distances + reaches > largest + slack)]
        if len(open_pieces) > 0:
            halves = np.empty((2 * len(open_pieces), 3, 3))
            halve_pieces(open_pieces, halves)
            waiting.append(halves)
    return largest


def _box_nodes(inside: BitGrid) -> FloatArray:
    """Tree over the runs of voxels along z, one box a run."""
    lows = BitGrid(inside.words & ~inside.follow, inside.depth).places.astype(np.float64)
    ends = BitGrid(inside.words & ~inside.precede, inside.depth).places
    highs = np.asarray(ends + 1.0, dtype=np.float64)
    nodes, _ = build_box_tree(lambda chosen: (lows[chosen], highs[chosen]), len(lows), 1)
    return nodes
