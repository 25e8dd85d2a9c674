"""Whether slices and sheets close all shafts between view cells and objects.

All boxes are rows (x0, y0, z0, x1, y1, z1) in voxels.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.sheets import CLEAR, SHUT, close, is_line_clear
from simplifier.kernels.slices import SAME

FREE, CROSSED, CLOSED = 0, 1, 2
"""A shaft whose middle line meets nothing solid, one whose does, and one that a layer closes."""

_ROUND = 1e-9  # voxels
# Voxels: a slice stands for faces that lie up to twice SAME beside it.  Nearer to a box than that
# one of them may be the box's own, which would be hidden by itself.
_BESIDE = 3.0 * SAME
_WHOLE = -1  # in place of a face: the cell itself
_DEPTH = 1024  # pairs that wait
_FINEST = 1.0  # voxels: edges of a face's pieces are not divided further
_WAIT = 12  # divisions after a search for a slice that found none, before the next search
RECENT = 8
"""Slices that are tried before a shaft is walked along: what closed one closes many beside it."""


@inline_kernel
def _pixel(edges, at):
    """The pixel of a coordinate from 0 to the last edge."""
    place = min(np.int64(at), len(edges) - 2)
    if at < edges[place]:
        return place - 1
    return place + 1 if at >= edges[place + 1] and place + 2 < len(edges) else place


@inline_kernel
def _span(a, b, axis, near, far, edges):
    """First and last pixel that a shaft covers along an axis, from ``near`` to ``far`` of the way.

    None is last if it leaves the picture.
    """
    low = min(a[axis] + near * (b[axis] - a[axis]), a[axis] + far * (b[axis] - a[axis]))
    high = max(
        a[axis + 3] + near * (b[axis + 3] - a[axis + 3]),
        a[axis + 3] + far * (b[axis + 3] - a[axis + 3]),
    )
    if low <= _ROUND or high >= edges[-1] - _ROUND:
        return np.int64(0), np.int64(-1)
    return _pixel(edges, low - _ROUND), _pixel(edges, high + _ROUND)


@inline_kernel
def _is_covered(sums, i, v0, v1, w0, w1):
    found = sums[v1 + 1, w1 + 1, i] - sums[v0, w1 + 1, i] - sums[v1 + 1, w0, i] + sums[v0, w0, i]
    return found == (v1 - v0 + 1) * (w1 - w0 + 1)


@inline_kernel
def _closes(a, b, k, i, at, edges_v, edges_w, picture):
    """Whether a slice is between two boxes, with all that it stands for, and covered all over their
    shaft."""
    if a[k + 3] + _BESIDE < at < b[k] - _BESIDE:
        near, far = (at - a[k + 3]) / (b[k + 3] - a[k + 3]), (at - a[k]) / (b[k] - a[k])
    elif b[k + 3] + _BESIDE < at < a[k] - _BESIDE:
        near, far = (at - a[k]) / (b[k] - a[k]), (at - a[k + 3]) / (b[k + 3] - a[k + 3])
    else:
        return False
    v0, v1 = _span(a, b, (k + 1) % 3, near, far, edges_v)
    w0, w1 = _span(a, b, (k + 2) % 3, near, far, edges_w)
    return v0 <= v1 and w0 <= w1 and _is_covered(picture, i, v0, v1, w0, w1)


@inner_kernel
def shaft(a, b, search, free, ats, firsts, edges, sums, closing, share):
    """What is between two boxes: :data:`FREE`, :data:`CROSSED` or :data:`CLOSED`.

    A plane between them cuts their shaft, which is the convex hull of both, in a figure whose box
    is that of the points between corners.  Where a slice covers all of it no line gets through.

    ``search``   whether to look for such a slice; else none is found where the middle line is one.
    ``free``, ``ats``, ``firsts``, ``edges``, ``sums``  as for :func:`see`.
    ``closing``  (2,) int64: the axis and the slice that close it are put there.
    ``share``    (1,) float64: how far along the middle line a slice first covers it.
    """
    main, most = 0, -1.0
    for k in range(3):
        length = abs(b[k] + b[k + 3] - a[k] - a[k + 3])
        if length > most:
            main, most = k, length
    found = FREE
    for turn in range(3):
        k = (main + turn) % 3
        v, w = (k + 1) % 3, (k + 2) % 3
        ak, bk = 0.5 * (a[k] + a[k + 3]), 0.5 * (b[k] + b[k + 3])
        apart = a[k + 3] < b[k] or b[k + 3] < a[k]
        if ak == bk or (found != FREE and not apart):
            continue
        av, aw = 0.5 * (a[v] + a[v + 3]), 0.5 * (a[w] + a[w + 3])
        dv = (0.5 * (b[v] + b[v + 3]) - av) / (bk - ak)
        dw = (0.5 * (b[w] + b[w + 3]) - aw) / (bk - ak)
        # One layer further on is so many voxels further along the axis that changes most.
        pace = max(abs(dv), abs(dw), 1.0)
        low, high = min(ak, bk), max(ak, bk)
        if found != FREE:
            low, high = min(a[k + 3], b[k + 3]), max(a[k], b[k])
        layer = np.int64(max(low, 0.0))
        last = np.int64(min(high, free.shape[k] - 0.5))
        # Taking an array out of a tuple counts a reference, for all threads: not in the loop.
        picture, own, begins = sums[k], ats[k], firsts[k]
        edges_v, edges_w = edges[v], edges[w]
        while layer <= last:
            pv, pw = av + (layer + 0.5 - ak) * dv, aw + (layer + 0.5 - ak) * dw
            if 0.0 <= pv < free.shape[v] and 0.0 <= pw < free.shape[w]:
                iv, iw = np.int64(pv), np.int64(pw)
                if k == 0:
                    steps = free[layer, iv, iw]
                elif k == 1:
                    steps = free[iw, layer, iv]
                else:
                    steps = free[iv, iw, layer]
                # Pixels lie up to one voxel further on than voxels of their number.
                safe = np.int64(np.floor((steps - 2.0) / pace - 0.5))
                if safe >= 0:
                    layer += safe + 1
                    continue
            for i in range(begins[layer], begins[layer + 1]):
                at = own[i]
                if at <= low or at >= high:
                    continue
                pv, pw = av + (at - ak) * dv, aw + (at - ak) * dw
                if pv < 0.0 or pw < 0.0 or pv >= free.shape[v] or pw >= free.shape[w]:
                    continue
                iv, iw = _pixel(edges_v, pv), _pixel(edges_w, pw)
                if not _is_covered(picture, i, iv, iv, iw, iw):
                    continue
                if found == FREE:
                    found, share[0] = CROSSED, (at - ak) / (bk - ak)
                    if not search:
                        return found
                if apart and _closes(a, b, k, i, at, edges_v, edges_w, picture):
                    closing[0], closing[1] = k, i
                    return CLOSED
            layer += 1
    return found


@inline_kernel
def _random(state):
    """The next of a sequence, and a number from 0 to 1 (Marsaglia, "Xorshift RNGs", 2003)."""
    state ^= (state << np.uint64(13)) & np.uint64(0xFFFFFFFFFFFFFFFF)
    state ^= state >> np.uint64(7)
    state ^= (state << np.uint64(17)) & np.uint64(0xFFFFFFFFFFFFFFFF)
    return state, (state >> np.uint64(11)) / 9007199254740992.0


@inline_kernel
def _is_glimpsed(
    cell, boxes, leaves, tries, seed, free, ats, firsts, edges, sums, points, faces, normals,
    sheet_boxes, sheet_children, a, b, closing, share,
):  # fmt: skip
    """Whether one of some random lines from a cell to the target meets nothing solid."""
    state = np.uint64(seed * 2654435761 + 88172645463325252)
    for _ in range(tries):
        state, part = _random(state)
        leaf = leaves[0] + np.int64(part * (leaves[1] - leaves[0]))
        for axis in range(3):
            state, part = _random(state)
            a[axis] = a[axis + 3] = cell[axis] + part * (cell[axis + 3] - cell[axis])
            state, part = _random(state)
            b[axis] = b[axis + 3] = boxes[leaf, axis] + part * (
                boxes[leaf, axis + 3] - boxes[leaf, axis]
            )
        if shaft(a, b, False, free, ats, firsts, edges, sums, closing, share) == FREE and (
            len(faces) == 0
            or is_line_clear(a[:3], b[:3], points, faces, normals, sheet_boxes, sheet_children)
        ):
            return True
    return False


@inline_kernel
def _longest(box):
    """The axis along which a box is longest, and how long."""
    axis, length = 0, box[3] - box[0]
    for other in (1, 2):
        if box[other + 3] - box[other] > length:
            axis, length = other, box[other + 3] - box[other]
    return axis, length


@inline_kernel
def _are_apart(a, b):
    on_x = a[3] < b[0] or b[3] < a[0]
    return on_x or a[4] < b[1] or b[4] < a[1] or a[5] < b[2] or b[5] < a[2]


@inline_kernel
def _copy(source, target):
    for i in range(6):
        target[i] = source[i]


@inline_kernel
def _to_front(recent, place, k, i):
    """Put a slice first, in place of the one at ``place``."""
    for other in range(place, 0, -1):
        recent[other, 0], recent[other, 1] = recent[other - 1, 0], recent[other - 1, 1]
    recent[0, 0], recent[0, 1] = k, i


@inline_kernel
def _is_closed_by_recent(a, b, ats, edges, sums, recent):
    """Whether one of the slices that closed others last does, which then goes first."""
    for place in range(RECENT):
        k, i = recent[place, 0], recent[place, 1]
        if _closes(a, b, k, i, ats[k][i], edges[(k + 1) % 3], edges[(k + 2) % 3], sums[k]):
            _to_front(recent, place, k, i)
            return True
    return False


@inner_kernel
def _may_see(
    cell, root, boxes, children, limit, sheet_limit, free, ats, firsts, edges, sums, points, faces,
    normals, beside, sheet_boxes, sheet_children, known, stack, nodes, sides, waits, b, closing,
    recent, share, work,
):  # fmt: skip
    """Whether some shaft between a cell and a target stays open; also when there is no telling
    within ``limit`` shafts.

    Pairs of boxes are divided until a layer or a sheet closes each.  A line leaves the cell through
    a face, on which all its way to the target begins anew: so of the cell only faces are divided,
    which are flat, and each looks only at what is on its outer side.
    """
    _copy(cell, stack[0])
    nodes[0], sides[0], waits[0] = root, _WHOLE, 0
    count, sheets_left = 1, sheet_limit if len(faces) > 0 else 0
    while count > 0:
        count -= 1
        a, node, face, wait = stack[count], nodes[count], sides[count], waits[count]
        _copy(boxes[node], b)
        if face != _WHOLE:
            axis = face % 3
            if face < 3:
                b[axis + 3] = min(b[axis + 3], a[axis])
            else:
                b[axis] = max(b[axis], a[axis])
            if b[axis] > b[axis + 3]:
                continue
        first, last = children[node, 0], children[node, 1]
        is_leaf = first == last
        apart = _are_apart(a, b)
        if apart:
            if _is_closed_by_recent(a, b, ats, edges, sums, recent):
                continue
            work[0] += 1
            limit -= 1
            found = shaft(a, b, wait == 0, free, ats, firsts, edges, sums, closing, share)
            if found == CLOSED:
                _to_front(recent, RECENT - 1, closing[0], closing[1])
                continue
            if sheets_left > 0:
                sheets_left -= 1
                met = close(
                    a, b, points, faces, normals, beside, sheet_boxes, sheet_children, known, share
                )
                if met == SHUT:
                    continue
                if met != CLEAR:
                    found = CROSSED
            if found == FREE or limit < 0:
                return True
            wait = wait - 1 if wait > 0 else _WAIT
        elif is_leaf and face == _WHOLE:
            return True
        axis, length = _longest(a)
        # The figure in a layer has so much of either box.
        larger = share[0] * _longest(b)[1] > (1.0 - share[0]) * length
        if not is_leaf and (not apart or larger or length <= _FINEST):
            for child in range(first, last):
                if child > first:
                    _copy(a, stack[count])
                nodes[count], sides[count], waits[count] = child, face, wait
                count += 1
        elif face == _WHOLE:
            for side in range(6):
                axis = side % 3
                if (side < 3 and b[axis] > cell[axis]) or (
                    side >= 3 and b[axis + 3] < cell[axis + 3]
                ):
                    continue
                _copy(cell, stack[count])
                stack[count, axis] = stack[count, axis + 3] = cell[side]
                nodes[count], sides[count], waits[count] = node, side, wait
                count += 1
        elif length > _FINEST:
            middle = 0.5 * (a[axis] + a[axis + 3])
            _copy(a, stack[count + 1])
            stack[count, axis + 3] = middle
            stack[count + 1, axis] = middle
            nodes[count + 1], sides[count + 1] = node, face
            waits[count], waits[count + 1] = wait, wait
            count += 2
        else:
            return True
    return False


@kernel(
    "int64, int64, float64[:, :], int64[:], int64[:, :], float64[:, :], int64[:, :], int64, "
    "int64, int64, int64, uint8[:, :, :], (float64[:], float64[:], float64[:]), (int64[:], "
    "int64[:], int64[:]), (float64[:], float64[:], float64[:]), (int32[:, :, :], "
    "int32[:, :, :], int32[:, :, :]), float64[:, :], int32[:, :], float64[:, :], int32[:, :], "
    "float64[:, :], int64[:, :], bool[:, :], int64[:, :]"
)
def see(
    begin, end, cells, roots, leaves, boxes, children, tries, seed, limit, sheet_limit, free, ats,
    firsts, edges, sums, points, faces, normals, beside, sheet_boxes, sheet_children, seen, work,
):  # fmt: skip
    """Set ``seen`` (c, n) bool for the cells ``begin`` to ``end``: which objects they may see.

    ``cells``     (c, 6) float64.
    ``boxes``     (k, 6) float64 of all objects' trees, ``children`` (k, 2) int64 first and one past
                  the last of each; none of a leaf.
    ``roots``     (n,) int64, -1 for an object without a box; ``leaves`` (n, 2) int64, its range.
    ``tries``     random lines that are looked along first, by ``seed``; ``limit`` shafts at most,
                  and in the first ``sheet_limit`` of each object sheets are looked for as well.
    ``free``      (nx, ny, nz) uint8: 0 in voxels that a slice covers some of, else steps to the
                  nearest one across faces, edges or corners, or fewer.
    ``ats``       for each axis (m,) float64: where its slices are, ascending; ``firsts`` (layers +
                  1,) int64 the first of each layer of voxels, and the end.
    ``edges``     for each axis (n + 1,) float64, ascending: of pixels along it, each less than half
                  from its number.
    ``sums``      for each axis (nv + 1, nw + 1, m) int32: covered pixels below each corner of a
                  slice, where v and w are the next axes in turn.  Slices come last: a line passes
                  many in much the same place.
    ``points``, ``faces``, ``normals``, ``beside``, ``sheet_boxes``, ``sheet_children``  triangles
                  that close shafts by themselves, as :func:`simplifier.kernels.sheets.close` has
                  them.
    ``work``      (c, 1) int64: adds up the shafts.
    """
    stack = np.empty((_DEPTH, 6))
    nodes, sides = np.empty(_DEPTH, np.int64), np.empty(_DEPTH, np.int64)
    known = np.full(len(faces), -1, np.int32)
    waits = np.empty(_DEPTH, np.int64)
    a, b, closing = np.empty(6), np.empty(6), np.zeros(2, np.int64)
    recent, share = np.zeros((RECENT, 2), np.int64), np.zeros(1)
    for cell in range(begin, end):
        recent[:] = 0  # else sets would depend on which cells one call is given
        for target in range(len(roots)):
            root = roots[target]
            if root < 0:
                continue
            seen[cell, target] = _is_glimpsed(
                cells[cell], boxes, leaves[target], tries,
                cell * len(roots) + target + seed * 1_000_003, free, ats, firsts, edges, sums,
                points, faces, normals, sheet_boxes, sheet_children, a, b, closing, share,
            ) or _may_see(
                cells[cell], root, boxes, children, limit, sheet_limit, free, ats, firsts, edges,
                sums, points, faces, normals, beside, sheet_boxes, sheet_children, known, stack,
                nodes, sides, waits, b, closing, recent, share, work[cell],
            )  # fmt: skip
