"""Boxes -> Tree: a bounding volume hierarchy by the surface-area heuristic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.kernels.tree import bound_nodes, split_boxes, widen


@dataclass(frozen=True, eq=False)
class Tree:
    """A wide bounding volume hierarchy; node 0 is the root, children come after their parent.

    ``bounds``       (k, 2, 3) float64: lowest and highest corner of each node's box.
    ``children``     (k, 2) int32: first child and how many, which follow each other; (0, 0) for a
                     leaf.
    ``spans``        (k, 2) int32: the places in ``order`` of what lies below a node.
    ``order``        (n,) int32: the things that the tree was built over; a leaf holds one.
    """

    bounds: FloatArray
    children: IntArray
    spans: IntArray
    order: IntArray

    def __len__(self) -> int:
        return len(self.bounds)

    def children_of(self, node: int) -> range:
        """Empty for a leaf."""
        first, count = self.children[node]
        return range(first, first + count)

    def below(self, node: int) -> IntArray:
        """The things below a node, or in a leaf."""
        begin, end = self.spans[node]
        return self.order[begin:end]

    @property
    def is_leaf(self) -> NDArray[np.bool_]:
        """(k,) whether a node has no children."""
        return np.asarray(self.children[:, 1] == 0)


def build_tree(boxes: FloatArray, width: int) -> Tree:
    """Tree over ``boxes`` (n, 2, 3), n at least 1, with 2 to ``width`` children a node.

    Binary splits by least cost (area times number, both sides), then small neighbours share a
    parent.  Nodes are numbered breadth first.  Where the planes may stand does not depend on the
    boxes, so that a change to one leaves most nodes as they are.
    """
    # Copies, so that the kernels get writable arrays whatever the caller has.
    lows, highs = (np.array(boxes[:, side], dtype=np.float64, order="C") for side in (0, 1))
    binary = 2 * len(boxes) - 1
    order = np.arange(len(boxes), dtype=np.int64)
    lefts = np.empty(binary, dtype=np.int64)
    spans = np.empty((binary, 2), dtype=np.int64)
    split_boxes(lows, highs, order, lefts, spans)
    bounds = np.empty((binary, 2, 3))
    bound_nodes(lows, highs, order, lefts, spans, bounds)
    first, counts, sources = (np.empty(binary, dtype=np.int64) for _ in range(3))
    nodes = widen(lefts, width, first, counts, sources)
    kept = sources[:nodes]
    first[:nodes][counts[:nodes] == 0] = 0
    children = np.column_stack([first[:nodes], counts[:nodes]])
    return Tree(
        bounds[kept], children.astype(np.int32), spans[kept].astype(np.int32),
        order.astype(np.int32),
    )  # fmt: skip
