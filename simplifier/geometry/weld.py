"""Corners in the same place become one vertex.

Faces -> pairs of corners that lie opposite of an edge which two faces share.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import IntArray

_Scalar = TypeVar("_Scalar", np.float64, np.float32)


def weld(vertices: NDArray[_Scalar], faces: NDArray[Any]) -> tuple[NDArray[_Scalar], IntArray]:
    """Vertices (k, 3), no two of them equal, and faces (m, 3) int32 of the same triangles.

    ``vertices`` (n, 3) finite, ``faces`` (m, 3).  Vertices stand in the order in which faces first
    name them, which is kind to caches; those that none names are left out.  0 and -0 are equal.
    """
    corners = np.ascontiguousarray(vertices[faces.reshape(-1)]) + 0  # no -0, which has other bits
    keys = corners.view(np.dtype((np.void, 3 * corners.itemsize))).reshape(-1)
    _, first, place = np.unique(keys, return_index=True, return_inverse=True)
    by_use = np.argsort(first, kind="stable")
    number = np.empty(len(first), dtype=np.int32)
    number[by_use] = np.arange(len(first), dtype=np.int32)
    return corners[first[by_use]], number[place.reshape(-1)].reshape(-1, 3)


def edge_pairs(faces: IntArray) -> NDArray[np.uint32]:
    """(k, 2) uint32: of each edge that two of the faces (m, 3) share, the corners opposite of it.

    Corner 3 f + i is the i-th of face f, so its face and the edge can be told from it.  Where more
    than two faces meet at an edge, every two of them are a pair.  Vertices are the same when their
    indices are.
    """
    ends = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, corners = ends[order], order.astype(np.uint32)
    pairs, step = [np.empty((0, 2), dtype=np.uint32)], 1
    while step < len(ends):
        same = np.nonzero((ends[:-step] == ends[step:]).all(axis=1))[0]
        if len(same) == 0:
            break
        pairs.append(np.column_stack([corners[same], corners[same + step]]))
        step += 1
    return np.ascontiguousarray(np.concatenate(pairs))
