"""Occluders for renderers that cull back faces.

Triangles of an occluder that pair up to convex quads.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.occluder import Occluder


def single_sided(occluder: Occluder) -> Occluder:
    """The same seen from everywhere, although back faces are culled.

    A part that is closed, each of its edges run along as often one way as the other, stays as it
    is, turned outwards: every line crosses as many of its front faces as of its back faces, so
    what it covers is the same.  Every other triangle is there in both windings, its own first.
    """
    if occluder.single_sided or len(occluder.faces) == 0:
        return replace(occluder, single_sided=True)
    faces, edge = occluder.faces, _edges_of(occluder.faces)
    part = _parts(edge)
    closed = _are_closed(faces, edge, part)[part]
    corners = occluder.vertices[faces]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    scale = float(np.abs(corners).max()) or 1.0  # cubes of lengths must not overflow or vanish
    volumes = np.linalg.det(corners / scale)
    inwards = closed & (np.bincount(part, weights=volumes)[part] < 0.0)
    outwards = np.where(inwards[:, None], faces[:, ::-1], faces)
    both = np.concatenate([outwards, faces[~closed][:, ::-1]])
    return replace(occluder, faces=np.ascontiguousarray(both), single_sided=True)


def _directed_edges(faces: IntArray) -> IntArray:
    """(3 m, 2): the edges as they are run along, face by face."""
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def _edges_of(faces: IntArray) -> NDArray[np.intp]:
    """(3 m,) which edge each of them is, whichever way it is run along."""
    _, edge = np.unique(np.sort(_directed_edges(faces), axis=1), axis=0, return_inverse=True)
    return edge.reshape(-1)


def _parts(edge: NDArray[np.intp]) -> NDArray[np.int32]:
    """(m,) which part each face is of: those that share an edge are of one."""
    # Here, not above: only single-sided files need them, and they take long to load.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    faces = len(edge) // 3
    face = np.repeat(np.arange(faces), 3)
    count = faces + int(edge.max()) + 1
    ones = np.ones(len(edge), dtype=np.int8)
    graph = coo_array((ones, (face, edge + faces)), shape=(count, count))
    _, part = connected_components(graph, directed=False)
    _, part = np.unique(part[:faces], return_inverse=True)
    return np.asarray(part, dtype=np.int32)


def _are_closed(
    faces: IntArray, edge: NDArray[np.intp], part: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """(parts,) whether each of its edges is run along as often one way as the other."""
    tails, heads = _directed_edges(faces).T
    balance = np.bincount(edge, weights=np.where(tails < heads, 1.0, -1.0))
    open_part = np.zeros(int(part.max()) + 1, dtype=np.bool_)
    open_part[np.repeat(part, 3)[balance[edge] != 0.0]] = True
    return ~open_part


FLAT = 1e-6
"""Of the box's longest edge: how far the fourth corner may be off the plane of the others."""

_STRAIGHT = 1e-6  # sine of the least angle at a corner, so that rounding leaves it convex


def quads_and_triangles(occluder: Occluder) -> tuple[IntArray, IntArray]:
    """(q, 4) and (t, 3) int32 indices of vertices, as many quads as there can be.

    Two triangles make a quad where they share an edge, lie in a plane and the quad is convex.  The
    shared edge is its diagonal from corner 0 to corner 2: cut there, it gives the two triangles
    back.  Each quad has the winding of its first triangle; a triangle of a single-sided occluder
    pairs only with one of the same winding.
    """
    import networkx  # a fifth of a second that only quads need

    corners = occluder.vertices[occluder.faces]
    pairs = _possible(occluder, corners)
    graph = networkx.Graph()
    graph.add_weighted_edges_from((a, b, roundness) for a, b, roundness, _ in pairs)
    # The most pairs; among those the most like rectangles.
    chosen = networkx.max_weight_matching(graph, maxcardinality=True)
    taken = {tuple(sorted(pair)) for pair in chosen}
    quads = [quad for a, b, _, quad in pairs if (a, b) in taken]
    paired = {face for pair in taken for face in pair}
    rest = [face for face in range(len(occluder.faces)) if face not in paired]
    return np.array(quads, dtype=np.int32).reshape(-1, 4), occluder.faces[rest]


def _possible(
    occluder: Occluder, corners: FloatArray
) -> list[tuple[int, int, int, tuple[int, int, int, int]]]:
    """Faces a < b that make a quad, how near its angles are to right ones (0 to 1000), and it."""
    if len(corners) == 0:
        return []
    flat = corners.reshape(-1, 3)
    extent = float((flat.max(axis=0) - flat.min(axis=0)).max())
    if not 0.0 < extent < np.inf:
        return []
    points = (occluder.vertices - flat.min(axis=0)) / extent
    found = []
    for (tail, head), faces in _by_edge(occluder.faces).items():
        for a, b in combinations(faces, 2):
            quad = _quad(occluder.faces[a], occluder.faces[b], tail, head)
            if quad is None or (occluder.single_sided and not _alike(occluder.faces[b], quad)):
                continue
            roundness = _roundness(points[list(quad)])
            if roundness is not None:
                found.append((a, b, roundness, quad))
    return sorted(found)


def _by_edge(faces: IntArray) -> dict[tuple[int, int], list[int]]:
    """The faces at each edge, whichever way they run along it; none that repeats a corner."""
    found: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
    for index, face in enumerate(faces.tolist()):
        for k in range(3) if len(set(face)) == 3 else ():
            tail, head = sorted((face[k], face[(k + 1) % 3]))
            found[tail, head].append(index)
    return found


def _quad(
    first: IntArray, second: IntArray, tail: int, head: int
) -> tuple[int, int, int, int] | None:
    """With the winding of ``first`` and the shared edge as its diagonal; None for a double."""
    (apex,) = (corner for corner in first.tolist() if corner not in (tail, head))
    (other,) = (corner for corner in second.tolist() if corner not in (tail, head))
    if apex == other:
        return None
    ring = first.tolist()
    begin = ring[(ring.index(apex) + 1) % 3]
    end = head if begin == tail else tail
    # first is apex, begin, end: the fourth corner lies beyond the edge from begin to end.
    return begin, other, end, apex


def _alike(face: IntArray, quad: tuple[int, int, int, int]) -> bool:
    """Whether the face runs as the quad's other half does."""
    ring = face.tolist()
    place = ring.index(quad[1])
    return bool(ring[(place + 1) % 3] == quad[2])


def _roundness(corners: FloatArray) -> int | None:
    """The least sine of the angles of a flat convex quad (4, 3), in thousandths; else None."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    if not (lengths > 0.0).all():
        return None
    turns = np.cross(np.roll(sides, 1, axis=0), sides) / (np.roll(lengths, 1) * lengths)[:, None]
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    size = float(np.linalg.norm(normal))
    if size == 0.0:
        return None
    normal /= size
    if abs(float((corners[3] - corners[0]) @ np.cross(sides[0], sides[1]))) > FLAT * float(
        np.linalg.norm(np.cross(sides[0], sides[1]))
    ):
        return None
    least = float((turns @ normal).min())
    return int(1000.0 * least) if least > _STRAIGHT else None
