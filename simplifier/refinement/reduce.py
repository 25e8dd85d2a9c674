"""TriangleMesh -> one of fewer triangles that looks the same from afar.

Vertices of a cell move to their mean (Rossignac and Borrel, 1993), where some are on a border to
that of these, in cells as fine as the number of triangles allows.  Where all triangles of a cell
would vanish, as in a cloud of specks, its largest one stays as it was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.thin import border_places, sum_up_cells, whole_faces

_MOST_VERTICES = 2_000_000  # of which three numbers fit into 64 bits
_COARSER = 0.95  # beyond what the numbers ask for, so that few rounds are needed


def reduce_to(mesh: TriangleMesh, most_triangles: int) -> TriangleMesh:
    """The mesh itself where it has no more; else at most as many, at least one, in its bounds.

    No vertex lies farther from one of the mesh than a cell's diagonal.
    """
    if len(mesh.faces) <= most_triangles:
        return mesh
    cells = np.sqrt(most_triangles / 2.0)
    border, shown = border_places(mesh.faces, len(mesh.vertices), sides_as_one=True), mesh
    while len(shown.faces) > most_triangles:
        shown = _cluster(mesh, border, max(1, int(cells)))
        cells *= _COARSER * min(1.0, np.sqrt(most_triangles / len(shown.faces)))
    return shown


def _cluster(mesh: TriangleMesh, border: BoolArray, cells: int) -> TriangleMesh:
    """``cells`` along the longest edge of the bounding box; ``border`` (n,) of the vertices."""
    low, high = mesh.bounds
    edge = float((high - low).max())
    shape = np.minimum(((high - low) / (edge / cells)).astype(np.int64) + 1, cells)
    steps = np.array([1, shape[0], shape[0] * shape[1]])
    place, counts, sums = sum_up_cells(mesh.vertices, low, 1.0, edge / cells, shape, steps, border)
    means = low + sums / counts[:, None]
    whole = whole_faces(mesh.faces, place)
    left = whole[first_faces(whole, len(means))]
    specks = mesh.faces[_largest(mesh, place, left)]
    return TriangleMesh.from_soup(
        np.concatenate([means, mesh.vertices[specks].reshape(-1, 3)]),
        np.concatenate([left, np.arange(3 * len(specks)).reshape(-1, 3) + len(means)]),
    )


def first_faces(faces: IntArray, vertices: int) -> NDArray[np.int64]:
    """(k,) the first face of each set of corners among ``faces`` (m, 3), in the order of these
    sets.  Corners are numbers below ``vertices``."""
    a, b, c = faces.T.astype(np.int64)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    pairs = low * vertices + (a + b + c - low - high)
    if vertices > _MOST_VERTICES:
        _, pairs = np.unique(pairs, return_inverse=True)
    keys = pairs * vertices + high
    # Not stable, which would take three times as long; so the first of equals is looked for.
    order = np.argsort(keys)
    ranked = keys[order]
    first = np.ones(len(faces), dtype=np.bool_)
    first[1:] = ranked[1:] != ranked[:-1]
    return np.asarray(np.minimum.reduceat(order, np.flatnonzero(first)))


def _largest(mesh: TriangleMesh, place: IntArray, left: IntArray) -> NDArray[np.int64]:
    """Of each cell that no triangle is left in, the largest one lost.

    ``place`` (n,) the cell of each vertex; a triangle is lost in that of its first corner.
    """
    bare = np.ones(len(place), dtype=np.bool_)
    bare[left] = False
    cell = place[mesh.faces[:, 0]]
    candidates = np.flatnonzero(bare[cell])
    order = np.lexsort((-_areas(mesh, mesh.faces[candidates]), cell[candidates]))
    _, first = np.unique(cell[candidates][order], return_index=True)
    return np.sort(candidates[order[first]])


def _areas(mesh: TriangleMesh, faces: IntArray) -> FloatArray:
    """Squared, in no particular unit."""
    a, b, c = (mesh.vertices[faces[:, corner]] for corner in range(3))
    return np.asarray((np.cross(b - a, c - a) ** 2).sum(axis=1))
