"""Triangle strips and fans as triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

IndexArray = NDArray[np.int64]


def strip_triangles(indices: IndexArray) -> IndexArray:
    """(m, 3) from (k,): k - 2 triangles that all wind like the first one.

    Triangles with a repeated index are left out: they are the stitches that join strips.
    """
    count = max(len(indices) - 2, 0)
    triangles = indices[np.arange(count)[:, None] + np.arange(3)]
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)])


def fan_triangles(indices: IndexArray) -> IndexArray:
    """(m, 3) from (k,): k - 2 triangles around the first index."""
    count = max(len(indices) - 2, 0)
    apex = np.full(count, indices[0] if count else 0, dtype=np.int64)
    return np.stack([apex, indices[1 : 1 + count], indices[2 : 2 + count]], axis=1)


def split_strips(sizes: IndexArray, items: IndexArray) -> IndexArray:
    """(m, 3) from lists of strips, as in PLY: -1 ends a strip inside a list."""
    ends = np.cumsum(sizes)[:-1]
    cuts = np.nonzero(items == -1)[0]
    pieces = np.split(items, np.unique(np.concatenate([ends, cuts])))
    triangles = [strip_triangles(piece[piece != -1]) for piece in pieces]
    return np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles])
