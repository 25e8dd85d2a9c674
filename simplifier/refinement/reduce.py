"""TriangleMesh -> one of fewer triangles that looks the same from afar.

Vertices of a cell move to their mean (Rossignac and Borrel, 1993), in cells as fine as the number
of triangles allows.  Where all triangles of a cell would vanish, as in a cloud of specks, its
largest one stays as it was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh

_COARSER = 0.95  # beyond what the numbers ask for, so that few rounds are needed


def reduce_to(mesh: TriangleMesh, most_triangles: int) -> TriangleMesh:
    """The mesh itself where it has no more; else at most as many, at least one, in its bounds.

    No vertex lies farther from one of the mesh than a cell's diagonal.
    """
    cells = np.sqrt(most_triangles / 2.0)
    shown = mesh
    while len(shown.faces) > most_triangles:
        shown = _cluster(mesh, max(1, int(cells)))
        cells *= _COARSER * min(1.0, np.sqrt(most_triangles / len(shown.faces)))
    return shown


def _cluster(mesh: TriangleMesh, cells: int) -> TriangleMesh:
    """``cells`` along the longest edge of the bounding box."""
    low, high = mesh.bounds
    places = (mesh.vertices - low) / ((high - low).max() / cells)
    corners = np.minimum(places.astype(np.int64), cells - 1)
    _, cell = np.unique((corners * [1, cells, cells * cells]).sum(axis=1), return_inverse=True)
    counts = np.bincount(cell)
    sums = [np.bincount(cell, mesh.vertices[:, axis] - low[axis]) for axis in range(3)]
    means = low + np.stack(sums, axis=1) / counts[:, None]
    faces = cell[mesh.faces]
    lost = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    left = _once(faces[~lost])
    specks = mesh.faces[_largest(mesh, lost, faces[:, 0], left)]
    return TriangleMesh.from_soup(
        np.concatenate([means, mesh.vertices[specks].reshape(-1, 3)]),
        np.concatenate([left, np.arange(3 * len(specks)).reshape(-1, 3) + len(means)]),
    )


def _once(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those with the same corners once, in no particular order."""
    low, middle, high = np.sort(faces, axis=1).T
    order = np.lexsort((high, middle, low))
    ranked = np.stack([low, middle, high])[:, order]
    first = np.ones(len(faces), dtype=bool)
    first[1:] = (ranked[:, 1:] != ranked[:, :-1]).any(axis=0)
    return faces[order[first]]


def _largest(
    mesh: TriangleMesh, lost: NDArray[np.bool_], cell: NDArray[np.int64], left: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Of each cell that no triangle is left in, the largest one lost."""
    bare = lost & ~np.isin(cell, left)
    candidates = np.flatnonzero(bare)
    order = np.lexsort((-_areas(mesh, mesh.faces[candidates]), cell[candidates]))
    _, first = np.unique(cell[candidates][order], return_index=True)
    return np.sort(candidates[order[first]])


def _areas(mesh: TriangleMesh, faces: IntArray) -> FloatArray:
    """Squared, in no particular unit."""
    a, b, c = (mesh.vertices[faces[:, corner]] for corner in range(3))
    return np.asarray((np.cross(b - a, c - a) ** 2).sum(axis=1))
