"""Whether the arrays of a packed tree are one: a walk ends, and every number names what is there.

All raise ValueError, which says what is wrong.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.packed_tree import MOST_SHORT, NONE, PackedTree

Numbers = NDArray[np.int64]


def check_tree(tree: PackedTree) -> None:
    """The nodes: each but the root is the child of one before it, and holds a run of parts."""
    nodes = tree.nodes
    if len(nodes) == 0:
        raise ValueError("it has no node")
    _check_finite("a node's box", nodes["low"], nodes["high"])
    if not (nodes["low"] <= nodes["high"]).all():
        raise ValueError("a node's lowest corner is above its highest")
    first, count = _numbers(nodes["first_child"]), _numbers(nodes["child_count"])
    inner = count > 0
    follow = 1 + np.cumsum(count) - count
    if 1 + count.sum() != len(nodes) or (first[inner] != follow[inner]).any():
        raise ValueError("the children are not in the order of their parents")
    if (first[inner] <= np.flatnonzero(inner)).any() or first[~inner].any():
        raise ValueError("a node comes after its children")
    _check_spans(tree, first, count)
    _check_occluders(tree, inner)


def _check_spans(tree: PackedTree, first: Numbers, count: Numbers) -> None:
    """The parts below a node are those below its children, one after the other."""
    begin, size = _numbers(tree.nodes["first_part"]), _numbers(tree.nodes["part_count"])
    end, inner = begin + size, count > 0
    expected = np.append(0, end[:-1])  # where the sibling before ends
    expected[first[inner]] = begin[inner]
    last = first[inner] + count[inner] - 1
    if (begin != expected).any() or (end[last] != end[inner]).any() or end[0] != len(tree.parts):
        raise ValueError("the parts of a node are not those of its children")
    if (size[~inner] != 1).any():
        raise ValueError("a leaf does not hold one part")


def _check_occluders(tree: PackedTree, inner: NDArray[np.bool_]) -> None:
    nodes = tree.nodes
    for name in ("far", "near"):
        found = _numbers(nodes[name])
        if ((found >= len(tree.meshes)) & (found != NONE)).any():
            raise ValueError("a node names an occluder that is not there")
    if (nodes["near"][inner] != NONE).any():
        raise ValueError("an inner node has a near occluder")
    for name in ("far_error", "switch_error", "far_radius", "near_radius"):
        _check_finite(f"the {name.replace('_', ' ')} of a node", nodes[name])
        if (nodes[name] < 0.0).any():
            raise ValueError(f"the {name.replace('_', ' ')} of a node is below 0")


def check_parts(tree: PackedTree) -> None:
    """Each part is in one leaf, and those of an object follow each other."""
    parts, order = tree.parts, _numbers(tree.order)
    if order.max() >= len(parts):
        raise ValueError("the order of the parts names one that is not there")
    leaves = np.flatnonzero(tree.nodes["child_count"] == 0)
    below = order[tree.nodes["first_part"][leaves]]
    if (parts["node"][below] != leaves).any():
        raise ValueError("a part does not name its leaf")
    check_object_order(_numbers(parts["object"]), len(tree.objects))
    if (parts["transform"] >= len(tree.transforms)).any():
        raise ValueError("a part names a transform that is not there")
    _check_finite("a transform", tree.transforms)


def check_object_order(object_of: NDArray[np.int32] | Numbers, count: int) -> None:
    """``object_of`` (p,), of one part at least: each of ``count`` objects has parts, which follow
    each other."""
    steps = np.diff(object_of, prepend=-1)
    if steps[0] != 1 or not np.isin(steps, (0, 1)).all() or steps.sum() != count:
        raise ValueError("the parts are not in the order of the objects")


def check_meshes(tree: PackedTree) -> None:
    """Each begins where the one before ends, so that looking at all takes as long as the file."""
    meshes = tree.meshes
    _check_finite("a position", meshes["origin"], tree.positions)
    vertices, triangles = _numbers(meshes["vertex_count"]), _numbers(meshes["triangle_count"])
    short = vertices <= MOST_SHORT
    words = -(-3 * triangles * np.where(short, 2, 4) // 4)
    for name, sizes, whole in (
        ("first_vertex", vertices, tree.positions),
        ("first_index", words, tree.indices),
        ("first_pair", _numbers(meshes["pair_count"]), tree.pairs),
    ):
        ends = np.cumsum(sizes)
        if (_numbers(meshes[name]) != ends - sizes).any() or sizes.sum() != len(whole):
            raise ValueError("an occluder does not begin where the one before ends")
    first = _numbers(meshes["first_index"])
    _check_below("vertex", tree.indices.view("<u2"), 2 * first, 2 * words, vertices, short)
    _check_below("vertex", tree.indices, first, words, vertices, ~short)
    pairs, count = tree.pairs.reshape(-1), 2 * _numbers(meshes["pair_count"])
    everyone = np.ones(len(meshes), dtype=np.bool_)
    _check_below("corner", pairs, np.cumsum(count) - count, count, 3 * triangles, everyone)


def _check_below(
    what: str, values: NDArray[Any], first: Numbers, count: Numbers, limits: Numbers,
    chosen: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Whether the values of each chosen run are below its limit; runs follow each other."""
    some = np.flatnonzero(chosen & (count > 0))
    if len(some) == 0:
        return
    bounds = np.column_stack([first[some], first[some] + count[some]]).reshape(-1)
    # A run to the end of the array has no second bound.
    largest = np.maximum.reduceat(values, bounds[bounds < len(values)])[::2]
    if (largest >= limits[some]).any():
        raise ValueError(f"an occluder names a {what} that it does not have")


def check_worth(tree: PackedTree) -> None:
    """Of the nodes, where it is told."""
    if tree.worth is None:
        return
    _check_finite("the worth of a node", tree.worth)
    if (tree.worth < 0.0).any():
        raise ValueError("the worth of a node is below 0")


def _check_finite(what: str, *arrays: NDArray[Any]) -> None:
    if not all(np.isfinite(one).all() for one in arrays):
        raise ValueError(f"{what} is not finite")


def _numbers(values: NDArray[Any]) -> Numbers:
    return values.astype(np.int64)
