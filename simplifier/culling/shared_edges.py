"""Faces -> pairs of faces that share an edge."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import IntArray


def shared_edges(faces: IntArray) -> IntArray:
    """(k, 6) int32 of ``faces`` (m, 3): both ends of an edge, the two third corners, the two faces.

    Where more than two faces meet at an edge, every two of them are a pair.  Vertices are the same
    when their indices are.
    """
    ends = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, thirds, owners = ends[order], faces.reshape(-1)[order], order // 3
    pairs, step = [np.empty((0, 6), dtype=np.int32)], 1
    while step < len(ends):
        same = np.nonzero((ends[:-step] == ends[step:]).all(axis=1))[0]
        if len(same) == 0:
            break
        columns = (thirds[same], thirds[same + step], owners[same], owners[same + step])
        pairs.append(np.column_stack([ends[same], *columns]).astype(np.int32))
        step += 1
    return np.ascontiguousarray(np.concatenate(pairs))
