"""Boxes -> a balanced tree of boxes around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray


@dataclass(frozen=True, eq=False)
class BoxTree:
    """A binary tree of n boxes in preorder: the first child of a node is the next node.

    ``boxes``   (2 n - 1, 6) float64: low, then high corner.
    ``rights``  (2 n - 1,) int64: the second child; -1 in leaves.
    ``items``   (2 n - 1,) int64: the box of a leaf; -1 in other nodes.
    """

    boxes: FloatArray
    rights: NDArray[np.int64]
    items: NDArray[np.int64]

    @classmethod
    def of(cls, boxes: FloatArray) -> BoxTree:
        """Of at least one box (n, 2, 3); groups are halved along the axis of their longest side."""
        count = len(boxes)
        flat = np.ascontiguousarray(boxes, dtype=np.float64).reshape(count, 6)
        middles = flat[:, :3] + flat[:, 3:]
        around = np.empty((2 * count - 1, 6))
        rights = np.full(2 * count - 1, -1, dtype=np.int64)
        items = np.full(2 * count - 1, -1, dtype=np.int64)
        waiting = [(0, np.arange(count))]
        while waiting:
            node, some = waiting.pop()
            around[node, :3] = flat[some, :3].min(axis=0)
            around[node, 3:] = flat[some, 3:].max(axis=0)
            if len(some) == 1:
                items[node] = some[0]
                continue
            axis = int(np.argmax(np.ptp(middles[some], axis=0)))
            half = len(some) // 2
            some = some[np.argsort(middles[some, axis], kind="stable")]
            rights[node] = node + 2 * half
            waiting += [(node + 1, some[:half]), (node + 2 * half, some[half:])]
        return cls(around, rights, items)

    @property
    def arrays(self) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
        """As kernels take it."""
        return self.boxes, self.rights, self.items
