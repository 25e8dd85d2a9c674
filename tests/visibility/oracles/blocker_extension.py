"""Blocker extension on an octree of voxels: a general method of visible sets, to compare with.

G. Schaufler, J. Dorsey, X. Decoret and F. Sillion, "Conservative Volumetric Visibility with
Occluder Fusion" (SIGGRAPH 2000).  Opaque nodes of the octree are taken from near to far.  Each is
extended to a box as large as opaque space and space that is hidden already allow: what passes
through hidden space has met an occluder before, so that the shadows of several become one.  What
lies in the shaft that the cell and this blocker span, behind the blocker, is hidden then.

A voxel is in the shaft where all segments from the cell's corners to its own meet the blocker.  For
convex blockers that holds for all points of both.  Plain NumPy: it is for tests, and for figures.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

_THINNER = 1e-9  # voxels, on all sides of a blocker: who touches it has not met it
_ROUNDS = 3  # blockers are extended anew into what was hidden since, so often at most

Box = tuple[np.ndarray, np.ndarray]
"""Low and high corner (3,) in voxels."""


def hidden_voxels(opaque: np.ndarray, cell: Box) -> np.ndarray:
    """(nx, ny, nz) bool: which voxels are hidden from all of a cell.

    ``opaque``  (nx, ny, nz) bool: voxels that are solid all over.
    ``cell``    low and high corner in voxels, anywhere; it must touch no opaque voxel.
    """
    hidden = np.zeros_like(opaque)
    nodes = opaque_nodes(opaque, cell)
    done: list[Box] = []
    for _ in range(_ROUNDS):
        before, first = int(hidden.sum()), len(done)
        for low, high in nodes:
            own = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
            # What has become a part of a blocker begins no other one in the same round.
            if hidden[own].all() or any(_holds(other, (low, high)) for other in done[first:]):
                continue
            for blocker in extended((low, high), opaque | hidden, cell):
                if not any(_holds(other, blocker) for other in done):
                    done.append(blocker)
                    _hide(hidden, cell, blocker)
        if int(hidden.sum()) == before:
            break
    return hidden


def opaque_nodes(opaque: np.ndarray, cell: Box) -> list[Box]:
    """The largest nodes of the octree that are opaque all over, the nearest to the cell first."""
    size = 1
    while size < max(opaque.shape):
        size *= 2
    whole = np.zeros((size, size, size), bool)
    whole[tuple(slice(n) for n in opaque.shape)] = opaque
    levels = [whole]
    while len(levels[-1]) > 1:
        half = len(levels[-1]) // 2
        levels.append(levels[-1].reshape(half, 2, half, 2, half, 2).all(axis=(1, 3, 5)))
    nodes = []
    above = np.zeros((1, 1, 1), bool)
    for level in reversed(range(len(levels))):
        full = levels[level]
        if len(above) < len(full):
            above = above.repeat(2, 0).repeat(2, 1).repeat(2, 2)
        places = np.argwhere(full & ~above)
        nodes += [(place * 2**level, (place + 1) * 2**level) for place in places]
        above = above | full
    return sorted(nodes, key=lambda node: _distance(node, cell))


def _holds(box: Box, other: Box) -> bool:
    return bool((box[0] <= other[0]).all() and (box[1] >= other[1]).all())


def _distance(node: Box, cell: Box) -> float:
    apart = np.maximum(np.maximum(node[0] - cell[1], cell[0] - node[1]), 0.0)
    return float((apart**2).sum())


def extended(node: Box, blocking: np.ndarray, cell: Box) -> list[Box]:
    """Boxes around a node that are blocking all over, grown along the axes in each order."""
    found = []
    for order in permutations(range(3)):
        low, high = node[0].copy(), node[1].copy()
        for axis in order:
            for side in (low, high):
                while _may_grow(low, high, axis, side is high, blocking, cell):
                    side[axis] += 1 if side is high else -1
        found.append((low, high))
    return found


def _may_grow(
    low: np.ndarray, high: np.ndarray, axis: int, upwards: bool, blocking: np.ndarray, cell: Box
) -> bool:
    """Whether the next layer along an axis is blocking all over, and the cell is not in it."""
    at = high[axis] if upwards else low[axis] - 1
    if not 0 <= at < blocking.shape[axis]:
        return False
    layer = [slice(a, b) for a, b in zip(low, high, strict=True)]
    layer[axis] = slice(at, at + 1)
    if not blocking[tuple(layer)].all():
        return False
    first, last = low.astype(float), high.astype(float)
    first[axis], last[axis] = at, at + 1
    return bool((first >= cell[1]).any() or (last <= cell[0]).any())


def _hide(hidden: np.ndarray, cell: Box, blocker: Box) -> None:
    """Mark what is behind a blocker, in its shaft with the cell, and not in the blocker itself."""
    shape = tuple(n + 1 for n in hidden.shape)
    points = np.stack(np.indices(shape), axis=-1).reshape(-1, 3).astype(float)
    # Corners between voxels that are hidden already cost nothing.
    padded = np.pad(~hidden, 1)
    wanted = np.zeros(shape, bool)
    for x, y, z in product((0, 1), repeat=3):
        wanted |= padded[x : x + shape[0], y : y + shape[1], z : z + shape[2]]
    within = wanted.ravel()
    for corner in product(*zip(*cell, strict=True)):
        there = np.flatnonzero(within)
        within[there] = meets(np.array(corner), points[there], blocker)
    inside = within.reshape(shape)
    behind = np.ones_like(hidden)
    for x, y, z in product((0, 1), repeat=3):
        behind &= inside[x : x + hidden.shape[0], y : y + hidden.shape[1], z : z + hidden.shape[2]]
    behind[tuple(slice(a, b) for a, b in zip(*blocker, strict=True))] = False
    hidden |= behind


def meets(eye: np.ndarray, points: np.ndarray, box: Box) -> np.ndarray:
    """(k,) bool: whether segments from a point (3,) to points (k, 3) meet the inside of a box."""
    towards = points - eye
    low, high = box[0] + _THINNER, box[1] - _THINNER
    first, last = np.zeros(len(points)), np.ones(len(points))
    for axis in range(3):
        along = towards[:, axis]
        still = along == 0.0
        way = np.where(still, 1.0, along)
        ends = np.stack([(low[axis] - eye[axis]) / way, (high[axis] - eye[axis]) / way])
        between = low[axis] <= eye[axis] <= high[axis]
        ends[0, still], ends[1, still] = (-np.inf, np.inf) if between else (np.inf, np.inf)
        near, far = ends.min(axis=0), ends.max(axis=0)
        first, last = np.maximum(first, near), np.minimum(last, far)
    return np.asarray(first <= last)


def opaque_voxels(boxes: np.ndarray, low: np.ndarray, size: float, shape: tuple[int, ...]):
    """(nx, ny, nz) bool: the voxels that lie in one of the boxes (n, 2, 3) wholly."""
    opaque = np.zeros(shape, bool)
    for first, last in (boxes - low) / size:
        begin = np.maximum(np.ceil(first - 1e-6), 0).astype(int)
        end = np.maximum(np.floor(last + 1e-6), 0).astype(int)
        opaque[tuple(slice(a, b) for a, b in zip(begin, end, strict=True))] = True
    return opaque


def visible_boxes(boxes: np.ndarray, cell: np.ndarray, size: float) -> np.ndarray:
    """(n,) bool: which boxes (n, 2, 3) a cell (2, 3) may see, by voxels of a size; world units.

    Voxels that are opaque with all around them do not count: who sees one has seen another before.
    """
    low = np.floor(boxes[:, 0].min(axis=0) / size) * size
    shape = np.ceil((boxes[:, 1].max(axis=0) - low) / size - 1e-6).astype(int)
    opaque = opaque_voxels(boxes, low, size, tuple(shape))
    hidden = hidden_voxels(opaque, tuple((cell - low) / size))
    around = np.pad(opaque, 1)
    inner = opaque.copy()
    for axis, shift in product(range(3), (-1, 1)):
        inner &= np.roll(around, shift, axis)[1:-1, 1:-1, 1:-1]
    open_ = ~(hidden | inner)
    visible = np.empty(len(boxes), bool)
    for index, (first, last) in enumerate((boxes - low) / size):
        begin = np.maximum(np.floor(first - 1e-6), 0).astype(int)
        end = np.ceil(last + 1e-6).astype(int)
        visible[index] = open_[tuple(slice(a, b) for a, b in zip(begin, end, strict=True))].any()
    return visible
