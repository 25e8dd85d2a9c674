"""UprightScene + voxels -> which closed pieces of its mesh each is in.

A piece is what shares corners, across objects.  It is closed if each of its edges has an even
number of triangles, or all other edges are on the ground.  Upwards from a point within, one crosses
it an odd number of times (M. Shimrat, "Algorithm 112: Position of point relative to polygon", 1962,
in space), so lines between points of other parity cross it too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.closed_pieces import mark_within
from simplifier.kernels.viewer_fill import sign_voxels
from simplifier.visibility.solid.spaces import Voxels

_FLAT = 1e-6  # of the scene's size: borders no higher are on its lowest plane
_HALL = 0.5  # of a view cell: what holds as much is where viewers are
_SAMPLES = 4  # along each axis of a cell


def signatures(
    upright: UprightScene, voxels: Voxels, places: NDArray[np.int64]
) -> tuple[NDArray[np.uint64], bool]:
    """(v,) of voxels (v, 3) that nothing touches: where two differ, a closed piece is between them.

    And whether all pieces are closed.  64 bits a piece, drawn once: two sets of pieces look alike
    once in 10^19.  Open pieces do not count, however little they lack.
    """
    infinite = np.full(3, np.inf)
    batches = list(upright.triangles(-infinite, infinite))
    counts = np.cumsum([0, *(len(vertices) for vertices, _ in batches)])
    points = np.concatenate([vertices for vertices, _ in batches])
    faces = np.concatenate([one + begin for (_, one), begin in zip(batches, counts, strict=False)])
    piece = closed_pieces(points, faces, _FLAT * float(upright.extent.max()))
    drawn = np.random.default_rng(0).integers(1, 2**63, int(piece.max(initial=0)) + 1, np.int64)
    keys = np.where(piece < 0, 0, drawn[piece]).astype(np.uint64)
    first_of = np.full(voxels.shape, -1, dtype=np.int32)
    next_of = np.full(len(places), -1, dtype=np.int32)
    for index, (x, y, _) in enumerate(places.tolist()):
        next_of[index], first_of[x, y] = first_of[x, y], index
    found = np.zeros(len(places), dtype=np.uint64)
    scaled = np.ascontiguousarray((points - voxels.origin) / voxels.cell)
    heights = np.ascontiguousarray(places[:, 2])
    sign_voxels(
        scaled, np.ascontiguousarray(faces, dtype=np.int32), keys, first_of, next_of, heights, found
    )
    return found, bool((piece >= 0).all())


def floor_of(viewers: ViewCells, size: float) -> float:
    """Up to which height the ground closes borders, in a scene of a ``size``; none from below."""
    return _FLAT * size if float(viewers.low[:, 2].min()) >= 0.0 else -np.inf


def closed_pieces(points: FloatArray, faces: IntArray, floor: float) -> NDArray[np.int64]:
    """(m,) the piece of each triangle, -1 for one that is not closed above the height ``floor``.

    Corners are the same if all digits are.
    """
    _, place = np.unique(points, axis=0, return_inverse=True)
    welded = place.reshape(-1)[faces]
    count = int(place.max()) + 1
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    links = sparse.coo_matrix((np.ones(len(edges), np.bool_), edges.T), (count, count))
    _, part = sparse.csgraph.connected_components(links, directed=False)
    heights = np.empty(count)
    heights[place.reshape(-1)] = points[:, 2]
    ordered = np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1)
    keys, times = np.unique(ordered[:, 0] * np.int64(count) + ordered[:, 1], return_counts=True)
    odd = keys[times % 2 == 1]
    a, b = odd // count, odd % count
    above = np.maximum(heights[a], heights[b]) > floor
    is_open = np.zeros(int(part.max()) + 1, dtype=np.bool_)
    is_open[part[a[above]]] = True
    piece = part[welded[:, 0]].astype(np.int64)
    return np.where(is_open[piece], -1, piece)


def is_within(
    places: FloatArray, points: FloatArray, faces: IntArray, pieces: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(k,) whether places (k, 3) lie in any closed piece, by a line straight up from each."""
    closed = np.flatnonzero(pieces >= 0)
    closed = closed[np.argsort(pieces[closed], kind="stable")]
    order = np.argsort(places[:, 0], kind="stable")
    odd, within = np.zeros((2, len(places)), dtype=np.bool_)
    mark_within(
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(faces[closed], dtype=np.int32),
        pieces[closed], np.ascontiguousarray(places[order], dtype=np.float64), odd, within,
    )  # fmt: skip
    found = np.empty(len(places), dtype=np.bool_)
    found[order] = within
    return found


def without_halls(
    points: FloatArray, faces: IntArray, pieces: NDArray[np.int64], cells: ViewCells
) -> NDArray[np.int64]:
    """The pieces of triangles, -1 for those of *halls* as well: of what viewers are in.

    A hall holds at least half of some cell.  From within, one crosses nothing on the way to what is
    in it, so it proves nothing to be hidden.  A wall that a cell reaches into holds less of it.  A
    prism counts as the box around it.
    """
    closed = np.flatnonzero(pieces >= 0)
    if len(closed) == 0 or len(cells) == 0:
        return pieces
    numbers, which = np.unique(pieces[closed], return_inverse=True)
    corners = points[faces[closed]]
    low, high = np.full((len(numbers), 3), np.inf), np.full((len(numbers), 3), -np.inf)
    np.minimum.at(low, which.reshape(-1), corners.min(axis=1))
    np.maximum.at(high, which.reshape(-1), corners.max(axis=1))
    sizes = cells.high - cells.low
    wide = (high - low >= _HALL * sizes.min(axis=0)).all(axis=1)
    found = pieces.copy()
    for place in np.flatnonzero(wide).tolist():
        shared = np.minimum(cells.high, high[place]) - np.maximum(cells.low, low[place])
        near = np.flatnonzero((np.maximum(shared, 0.0) / sizes).prod(axis=1) >= _HALL)
        own = pieces == numbers[place]
        if len(near) and _share_within(cells.some(near), points, faces[own]).max() >= _HALL:
            found[own] = -1
    return found


def _share_within(cells: ViewCells, points: FloatArray, faces: IntArray) -> FloatArray:
    """(c,) how much of each cell a closed piece holds, by points all over it."""
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    lattice = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    places = cells.low[:, None] + lattice * (cells.high - cells.low)[:, None]
    one = np.zeros(len(faces), dtype=np.int64)
    inside = is_within(places.reshape(-1, 3), points, faces, one)
    return np.asarray(inside.reshape(len(cells), -1).mean(axis=1))
