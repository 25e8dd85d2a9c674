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
from simplifier.kernels.viewer_fill import sign_voxels
from simplifier.visibility.solid.spaces import Voxels

_FLAT = 1e-6  # of the scene's size: borders no higher are on its lowest plane


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
    solid = faces[pieces >= 0]
    owners = pieces[pieces >= 0]
    a, b, c = (points[solid[:, corner]] for corner in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    found = np.zeros(len(places), dtype=np.bool_)
    for index, place in enumerate(places):
        near = (low[:, :2] <= place[:2]).all(axis=1) & (high[:, :2] >= place[:2]).all(axis=1)
        near &= high[:, 2] > place[2]
        crossed = owners[near][_is_below(place, a[near], b[near], c[near])]
        found[index] = bool((np.bincount(crossed, minlength=1) % 2 == 1).any())
    return found


def _is_below(place: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> NDArray[np.bool_]:
    """(m,) whether a place is straight below triangles."""
    times = np.zeros(len(a), dtype=np.int64)
    for p, q in ((a, b), (b, c), (c, a)):
        # The same numbers from both sides of an edge: a place beside it is in one triangle of two.
        turned = (p[:, 0] > q[:, 0]) | ((p[:, 0] == q[:, 0]) & (p[:, 1] > q[:, 1]))
        first, last = np.where(turned[:, None], q, p), np.where(turned[:, None], p, q)
        spans = (first[:, 0] <= place[0]) & (last[:, 0] > place[0])
        side = (last[:, 0] - first[:, 0]) * (place[1] - first[:, 1])
        side = side - (last[:, 1] - first[:, 1]) * (place[0] - first[:, 0])
        times += spans & (side < 0.0)
    normal = np.cross(b - a, c - a)
    height = np.einsum("ij,ij->i", a - place, normal)
    return np.asarray((times % 2 == 1) & (height * normal[:, 2] > 0.0))
