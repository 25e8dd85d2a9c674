"""PackedTree + cameras -> what drawing each node's occluders is worth, where triangles are few.

In each view every occluder that the whole tree draws is drawn by itself, which tells the parts that
it hides alone.  Of these pairs of view and part a cover is chosen greedily, by the most new pairs
for a triangle (Nemhauser, Wolsey, Fisher: An Analysis of Approximations for Maximizing Submodular
Set Functions, 1978; gains fall as more is chosen, so old ones are bounds and few are counted again,
Minoux 1978).  What an occluder adds to the cover, over all views, by its triangles, is its worth.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.packed_tree import PackedTree
from simplifier.geometry.solid import BoolArray
from simplifier.progress import TellCount


@dataclass(frozen=True, eq=False)
class Ranking:
    """What the views say.

    ``tree``   with its ``worth``: 1 is the middle one of those that add something, and what no view
               drew; 0 is what was drawn and adds nothing.
    ``drawn``, ``useful``  nodes of which an occluder was drawn in some view, and added something.
    """

    tree: PackedTree
    drawn: int
    useful: int


@dataclass(frozen=True, eq=False)
class _Drawn:
    """An occluder of one view: ``hides`` (h,) which of the parts that are hidden in all."""

    node: int
    triangles: int
    hides: BoolArray


def rank_occluders(
    tree: PackedTree,
    cameras: Sequence[Camera],
    rows: int,
    columns: int,
    tell: TellCount = lambda done, total: None,
) -> Ranking:
    """Rank by what is hidden from the cameras, on a depth buffer of that size."""
    gains, triangles = np.zeros(len(tree.nodes)), np.zeros(len(tree.nodes))
    whole, alone = (Culler(tree, _buffer(tree, rows, columns)) for _ in range(2))
    boxes = tree.boxes[tree.parts["node"]]
    for index, camera in enumerate(cameras):
        tell(index, len(cameras))
        culled = whole.cull(camera)
        hidden = boxes[culled.verdicts == Verdict.HIDDEN]
        drawn = [_alone(alone, one, camera, hidden) for one in culled.drawn]
        for one in drawn:
            triangles[one.node] = max(one.triangles, triangles[one.node])
        for node, gain in _cover(drawn, len(hidden)):
            gains[node] += gain
    useful = gains > 0.0
    worth = gains / np.maximum(triangles, 1.0)
    if useful.any():
        worth /= np.median(worth[useful])
    ranked = replace(tree, worth=np.where(triangles > 0.0, worth, 1.0).astype(np.float32))
    return Ranking(ranked, int((triangles > 0.0).sum()), int(useful.sum()))


def found_within(
    tree: PackedTree, cameras: Sequence[Camera], rows: int, columns: int, most: int | None
) -> int:
    """Pairs of camera and part that are found hidden with so many triangles a frame."""
    culler = Culler(tree, _buffer(tree, rows, columns), most_triangles=most)
    return sum(
        int(np.count_nonzero(culler.cull(camera).verdicts == Verdict.HIDDEN)) for camera in cameras
    )


def around(camera: Camera) -> list[Camera]:
    """The same camera turned to its four sides: who walks there looks anywhere."""
    right, up, ahead = camera.axes
    turned = ((right, ahead), (ahead, -right), (-right, -ahead), (-ahead, right))
    return [
        Camera(camera.position, np.array([across, up, forward]), camera.fov, camera.near)
        for across, forward in turned
    ]


def _buffer(tree: PackedTree, rows: int, columns: int) -> DepthBuffer:
    return DepthBuffer(rows, columns, "inner" if tree.conservative else "centre")


def _alone(culler: Culler, one: tuple[int, int], camera: Camera, hidden: FloatArray) -> _Drawn:
    culler.buffer.clear()
    triangles = culler.draw(*one, camera)
    return _Drawn(one[0], triangles, culler.buffer.test(hidden, camera) == Verdict.HIDDEN)


def _cover(drawn: Sequence[_Drawn], count: int) -> list[tuple[int, int]]:
    """(node, what it adds) of those that add something, in the order of choice."""
    left: NDArray[np.bool_] = np.ones(count, dtype=np.bool_)
    waiting = [(-np.inf, place) for place in range(len(drawn))]
    chosen = []
    while waiting:
        bound, place = heapq.heappop(waiting)
        one = drawn[place]
        gain = int(np.count_nonzero(one.hides & left))
        if gain == 0:
            continue
        key = -gain / max(one.triangles, 1)
        if key > bound and waiting and (key, place) > waiting[0]:
            heapq.heappush(waiting, (key, place))  # another may add more now
            continue
        chosen.append((one.node, gain))
        left &= ~one.hides
    return chosen
