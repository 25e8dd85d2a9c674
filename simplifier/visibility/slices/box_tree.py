"""Boxes -> a tree of boxes that hold two others each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

Ids = NDArray[np.int64]


def tree_over(low: FloatArray, high: FloatArray) -> tuple[FloatArray, Ids, Ids]:
    """Boxes (k, 6) and children (k, 2) first and one past the last, leaves first and the root last.

    The leaves are those from ``low`` to ``high`` (m, 3) in the order (m,) that is returned as well:
    halves of them are divided where their middles are furthest apart.
    """
    order = _halved(0.5 * (low + high))
    level = np.concatenate([low, high], axis=1)[order].astype(np.float64)
    boxes, children = [level], [np.zeros((len(level), 2), dtype=np.int64)]
    begin = 0
    while len(level) > 1:
        firsts = np.arange(0, len(level), 2)
        lower = np.minimum.reduceat(level[:, :3], firsts)
        upper = np.maximum.reduceat(level[:, 3:], firsts)
        ends = np.minimum(firsts + 2, len(level))
        children.append(begin + np.column_stack([firsts, ends]))
        begin += len(level)
        level = np.concatenate([lower, upper], axis=1)
        boxes.append(level)
    return np.concatenate(boxes), np.concatenate(children), order


def _halved(middles: FloatArray) -> Ids:
    """An order (m,) in which each aligned power of two is near together."""
    order = np.arange(len(middles))
    waiting = [(0, len(middles))]
    while waiting:
        begin, end = waiting.pop()
        if end - begin < 3:
            continue
        own = order[begin:end]
        at = middles[own]
        axis = int(np.argmax(np.ptp(at, axis=0)))
        order[begin:end] = own[np.argsort(at[:, axis], kind="stable")]
        middle = begin + (1 << (end - begin - 1).bit_length() - 1)
        waiting += [(begin, middle), (middle, end)]
    return order
