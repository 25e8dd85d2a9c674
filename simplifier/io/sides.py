"""Occluders for renderers that cull back faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import IntArray
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
    closed = _closed(faces, edge, part)[part]
    corners = occluder.vertices[faces]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    scale = float(np.abs(corners).max()) or 1.0  # cubes of lengths must not overflow or vanish
    volumes = np.linalg.det(corners / scale)
    inwards = closed & (np.bincount(part, weights=volumes)[part] < 0.0)
    outwards = np.where(inwards[:, None], faces[:, ::-1], faces)
    both = np.concatenate([outwards, faces[~closed][:, ::-1]])
    return replace(occluder, faces=np.ascontiguousarray(both), single_sided=True)


def _directed(faces: IntArray) -> IntArray:
    """(3 m, 2): the edges as they are run along, face by face."""
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def _edges_of(faces: IntArray) -> NDArray[np.intp]:
    """(3 m,) which edge each of them is, whichever way it is run along."""
    _, edge = np.unique(np.sort(_directed(faces), axis=1), axis=0, return_inverse=True)
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


def _closed(faces: IntArray, edge: NDArray[np.intp], part: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(parts,) whether each of its edges is run along as often one way as the other."""
    tails, heads = _directed(faces).T
    balance = np.bincount(edge, weights=np.where(tails < heads, 1.0, -1.0))
    open_part = np.zeros(int(part.max()) + 1, dtype=np.bool_)
    open_part[np.repeat(part, 3)[balance[edge] != 0.0]] = True
    return ~open_part
