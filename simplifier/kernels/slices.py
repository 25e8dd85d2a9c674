"""Which pixels of planes across an axis are covered by what closed pieces of a mesh fill."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

SAME = 1e-5
"""Voxels: flat faces that differ by no more are in one slice."""

_CRACK = 1e-6  # pixels: pieces that touch each other may be rounded apart by so much

_WITHIN = 2e-6  # pixels: lines along edges run so far within, for faces may lie along the edge


@inline_kernel
def _cut(points, a, b, at):
    """Where the edge between two corners meets the plane u = ``at``, as (v, w).

    The lower corner goes first, so that all triangles of an edge get the same numbers.
    """
    if points[a, 0] > points[b, 0]:
        a, b = b, a
    share = (at - points[a, 0]) / (points[b, 0] - points[a, 0])
    v = points[a, 1] + share * (points[b, 1] - points[a, 1])
    return v, points[a, 2] + share * (points[b, 2] - points[a, 2])


@inline_kernel
def _section(points, face, at):
    """Whether a triangle crosses a plane, and the two points (v, w) in which it does."""
    a, b, c = face[0], face[1], face[2]
    ha, hb, hc = points[a, 0] > at, points[b, 0] > at, points[c, 0] > at
    if ha == hb and hb == hc:
        return False, 0.0, 0.0, 0.0, 0.0
    if ha == hb:
        a, c = c, a
    elif ha == hc:
        a, b = b, a
    v0, w0 = _cut(points, a, b, at)
    v1, w1 = _cut(points, a, c, at)
    return True, v0, w0, v1, w1


@inner_kernel
def _along(middle, across, along, owners, edges, ends, covered, state):
    """Go along lines through the rows of a picture (n, m).

    What is between an odd number of crossings of any owner is filled.  Of lines through the
    ``middle`` of rows, pixels that they are filled along become covered.  Else there are
    lines along both edges of each row as well, and pixels that one is not filled along are covered
    no more.

    ``across``, ``along``  (k, 2) float64: both ends of segments; ``owners`` (k,) int32.
    ``edges``, ``ends``    (n + 1,) and (m + 1,) float64: of the pixels, ascending.
    ``state``  bool, as many as owners, all False before and after.
    """
    rows = len(edges) - 1
    lines = 0.5 * (edges[1:] + edges[:-1])
    if not middle:
        middles, lines = lines, np.empty(3 * rows)
        lines[0::3], lines[1::3], lines[2::3] = edges[:-1] + _WITHIN, middles, edges[1:] - _WITHIN
    firsts, lasts = np.searchsorted(lines, across[:, 0]), np.searchsorted(lines, across[:, 1])
    heads = np.full(len(lines), -1, dtype=np.int64)
    room = np.abs(lasts - firsts).sum()
    heights = np.empty(room)
    whose = np.empty(room, dtype=np.int32)
    after = np.empty(room, dtype=np.int64)
    used = 0
    for place in range(len(owners)):
        v0, v1, w0, w1 = across[place, 0], across[place, 1], along[place, 0], along[place, 1]
        for line in range(min(firsts[place], lasts[place]), max(firsts[place], lasts[place])):
            w = w0 + (w1 - w0) * ((lines[line] - v0) / (v1 - v0))
            before, follows = -1, heads[line]
            while follows >= 0 and heights[follows] < w:
                before, follows = follows, after[follows]
            heights[used], whose[used], after[used] = w, owners[place], follows
            if before < 0:
                heads[line] = used
            else:
                after[before] = used
            used += 1
    for line in range(len(lines)):
        row = line if middle else line // 3
        if heads[line] < 0 and middle:
            continue
        inside, low, crossing = 0, -np.inf, heads[line]
        begun, ended = -np.inf, -np.inf  # of what is filled without a crack
        while True:
            high = heights[crossing] if crossing >= 0 else np.inf
            if middle and (inside > 0 or crossing < 0):
                if low - ended > _CRACK or crossing < 0:
                    first = np.searchsorted(ends, begun - _CRACK)
                    last = np.searchsorted(ends, ended + _CRACK, side="right") - 1
                    covered[row, first : max(last, first)] = True
                    begun = low
                ended = high
            elif not middle and inside == 0 and high - low > _CRACK:
                first = max(np.searchsorted(ends, low + _CRACK, side="right") - 1, 0)
                last = np.searchsorted(ends, high - _CRACK)
                covered[row, first : max(last, first)] = False
            if crossing < 0:
                break
            owner = whose[crossing]
            state[owner] = not state[owner]
            inside += 1 if state[owner] else -1
            low, crossing = high, after[crossing]


@kernel(
    "float64[:, :], int32[:, :], int32[:], int64[:], int32[:], int64[:], int32[:], float64[:], "
    "float64[:], float64[:], int64, int64, bool[:, :, :]"
)
def cover_slices(
    points, faces, pieces, starts, listed, flat_starts, flat_listed, ats, edges, ends, begin, end,
    covered,
):  # fmt: skip
    """Set ``covered`` (m, nv, nw) bool, False at first, in the slices ``begin`` to ``end``.

    Axes are u, v, w; slices are the planes u = ``ats`` (m,), float64.  A pixel is covered if lines
    along both axes, of which some run along its edges, lie all over it in closed pieces, or in
    triangles of the plane itself.

    ``points``  (n, 3) float64, voxels; ``faces`` (k, 3) int32; ``pieces`` (k,) int32, -1 for those
                that are of no closed piece.
    ``starts``, ``listed``  the faces of pieces that may cross each slice, CSR: int64, int32;
    ``flat_starts``, ``flat_listed``  other faces that lie in it.
    ``edges``, ``ends``  (nv + 1,) and (nw + 1,) float64: of the pixels along v and w, ascending.
    """
    count = pieces.max() + 1 if len(pieces) else 0
    for i in range(begin, end):
        flat = flat_starts[i + 1] - flat_starts[i]
        most = starts[i + 1] - starts[i] + 3 * flat
        if most == 0:
            continue
        across, along = np.empty((most, 2)), np.empty((most, 2))
        owners = np.empty(most, dtype=np.int32)
        found = 0
        for place in range(starts[i], starts[i + 1]):
            face = listed[place]
            crosses, v0, w0, v1, w1 = _section(points, faces[face], ats[i])
            if crosses:
                across[found, 0], across[found, 1] = v0, v1
                along[found, 0], along[found, 1] = w0, w1
                owners[found] = pieces[face]
                found += 1
        for place in range(flat):
            face = flat_listed[flat_starts[i] + place]
            for side in range(3):
                a, b = faces[face, side], faces[face, (side + 1) % 3]
                if points[a, 1] > points[b, 1]:
                    a, b = b, a
                across[found, 0], across[found, 1] = points[a, 1], points[b, 1]
                along[found, 0], along[found, 1] = points[a, 2], points[b, 2]
                owners[found] = count + place
                found += 1
        across, along, owners = across[:found], along[:found], owners[:found]
        state = np.zeros(count + flat, dtype=np.bool_)
        _along(True, across, along, owners, edges, ends, covered[i], state)
        if covered[i].any():
            _along(False, across, along, owners, edges, ends, covered[i], state)
            _along(False, along, across, owners, ends, edges, covered[i].T, state)
