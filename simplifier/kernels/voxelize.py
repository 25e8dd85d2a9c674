"""Mark the voxels that triangles touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.threads import run_chunks

ROOM = "(uint8[:, :, :], uint8[:, :, :], uint8[:, :, :], int64, uint64[:, :, :], float64[:])"
"""A room as :func:`is_contained` takes it, in words of a kernel's signature."""

# A triangle that touches a voxel's face counts as inside on both sides of it.  Rounding of the
# transform to grid space must not decide that, so "touches" means "comes within this", in voxels.
_TOUCH = 1e-9

_LEAST_WORK = 4096
"""Triangles of a voxel, or voxels of larger ones, that are worth a hand-over to another thread."""

_WORD = 4  # voxels of a cell along each axis, of which a word has a bit each

_FEW_CELLS = 200  # are looked at sooner than it is found out which of them a triangle touches


@inline_kernel
def _edge(ax, ay, bx, by, sign):
    """Edge a -> b as (nx, ny, offset): n . p + offset >= 0 for unit boxes at p that it admits."""
    nx = (ay - by) * sign
    ny = (bx - ax) * sign
    length = abs(nx) + abs(ny)
    if length <= _TOUCH:  # so short that the sign may be noise; the other two say all there is
        return 0.0, 0.0, 0.0
    slack = _TOUCH * length
    offset = max(nx, 0.0) + max(ny, 0.0) - (nx * ax + ny * ay) + slack
    return nx, ny, offset


@inline_kernel
def _span(a, b, c, limit):
    """First and last of ``limit`` unit intervals that the numbers a, b, c reach, ends included."""
    # Conversion rounds towards zero, which is down here: the numbers are -1e-9 at the least.
    first = min(np.int64(max(min(a, b, c) - _TOUCH, 0.0)), limit - 1)
    last = min(np.int64(max(a, b, c) + _TOUCH), limit - 1)
    return first, last


@inline_kernel
def _sides(p, q, r):
    """What decides which unit boxes a triangle touches: nine edges, and its plane over a square.

    Axes come in cyclic order u, v, w where w is the dominant axis of the triangle's normal.
    """
    pu, pv, pw = p
    qu, qv, qw = q
    ru, rv, rw = r
    nu = (qv - pv) * (rw - pw) - (qw - pw) * (rv - pv)
    nv = (qw - pw) * (ru - pu) - (qu - pu) * (rw - pw)
    nw = (qu - pu) * (rv - pv) - (qv - pv) * (ru - pu)
    # Edges seen along w (axes u, v), along u (axes v, w), along v (axes w, u): each cyclic
    # projection keeps the winding, up to the sign of the normal's component along the view.
    sign_u = 1.0 if nu > 0.0 else -1.0
    sign_v = 1.0 if nv > 0.0 else -1.0
    sign_w = 1.0 if nw > 0.0 else -1.0
    along_w = (
        _edge(pu, pv, qu, qv, sign_w), _edge(qu, qv, ru, rv, sign_w), _edge(ru, rv, pu, pv, sign_w)
    )  # fmt: skip
    along_u = (
        _edge(pv, pw, qv, qw, sign_u), _edge(qv, qw, rv, rw, sign_u), _edge(rv, rw, pv, pw, sign_u)
    )  # fmt: skip
    along_v = (
        _edge(pw, pu, qw, qu, sign_v), _edge(qw, qu, rw, ru, sign_v), _edge(rw, ru, pw, pu, sign_v)
    )  # fmt: skip
    # Over the unit square at (s, t) the plane's w-coordinate spans base + [drop, rise].
    slope_u = -nu / nw if nw != 0.0 else 0.0
    slope_v = -nv / nw if nw != 0.0 else 0.0
    # The normal of a needle may be noise.  Its plane then misses the corners by so much, and the
    # edges alone decide, which is exact for a segment.
    error = max(
        abs(slope_u * (qu - pu) + slope_v * (qv - pv) - (qw - pw)),
        abs(slope_u * (ru - pu) + slope_v * (rv - pv) - (rw - pw)),
    )
    drop = min(slope_u, 0.0) + min(slope_v, 0.0) - error - _TOUCH
    rise = max(slope_u, 0.0) + max(slope_v, 0.0) + error + _TOUCH
    return along_w, along_u, along_v, (pu, pv, pw), (slope_u, slope_v, drop, rise)


@inline_kernel
def _admit(edges, x, y):
    """Whether all three edges admit the unit square at (x, y)."""
    (ax, ay, a), (bx, by, b), (cx, cy, c) = edges
    return ax * x + ay * y + a >= 0.0 and bx * x + by * y + b >= 0.0 and cx * x + cy * y + c >= 0.0


@inline_kernel
def _column(sides, s, t, low, high):
    """First and last box over the square (s, t) that the plane may pass; none if last < first."""
    _, _, _, (pu, pv, pw), (slope_u, slope_v, drop, rise) = sides
    base = pw + slope_u * (s - pu) + slope_v * (t - pv)
    first = max(np.int64(np.ceil(base + drop)) - 1, low)
    return first, min(np.int64(np.floor(base + rise)), high)


@inline_kernel
def _touches(sides, s, t, k):
    """Whether a box of that row is touched."""
    return _admit(sides[1], t, k) and _admit(sides[2], k, s)


@inline_kernel
def _mark_layer(p, q, r, low, high, strides, touched):
    """As :func:`_mark_footprint`, of a box that is one voxel thick along its last axis.

    The triangle lies between the two planes of that layer, so it touches the voxels whose squares
    it touches as seen along that axis.
    """
    area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    sign = 1.0 if area > 0.0 else -1.0
    edges = (
        _edge(p[0], p[1], q[0], q[1], sign), _edge(q[0], q[1], r[0], r[1], sign),
        _edge(r[0], r[1], p[0], p[1], sign),
    )  # fmt: skip
    for s in range(low[0], high[0] + 1):
        for t in range(low[1], high[1] + 1):
            if _admit(edges, s, t):
                touched[s * strides[0] + t * strides[1] + low[2] * strides[2]] = True


@inner_kernel
def _mark_footprint(p, q, r, low, high, strides, touched):
    """Set the voxels of the box ``low`` to ``high`` that the triangle touches.

    Axes as for :func:`_sides`; ``strides`` are those of the flat array ``touched``.
    """
    sides = _sides(p, q, r)
    for s in range(low[0], high[0] + 1):
        for t in range(low[1], high[1] + 1):
            if not _admit(sides[0], s, t):
                continue
            first, last = _column(sides, s, t, low[2], high[2])
            for k in range(first, last + 1):
                place = s * strides[0] + t * strides[1] + k * strides[2]
                if not touched[place] and _touches(sides, s, t, k):
                    touched[place] = True


@inner_kernel
def _keeps_below(sides, low, high, strides, layers, limit):
    """Whether no voxel of the box ``low`` to ``high`` that the triangle touches is above a limit.

    ``sides`` and axes as of :func:`_sides`; ``strides`` are those of the flat array ``layers``.
    """
    for s in range(low[0], high[0] + 1):
        for t in range(low[1], high[1] + 1):
            if not _admit(sides[0], s, t):
                continue
            first, last = _column(sides, s, t, low[2], high[2])
            for k in range(first, last + 1):
                place = s * strides[0] + t * strides[1] + k * strides[2]
                if layers[place] > limit and _touches(sides, s, t, k):
                    return False
    return True


@inline_kernel
def _all_corners(low, high, strides, touched):
    """Whether all corners of a box are set: of two voxels along an axis, or one, these are all.

    Fine meshes mark a voxel many times over.  Eight looks cost less than a wrong guess of the
    processor's at how many there are to look at.
    """
    place = np.uint64(low[0] * strides[0] + low[1] * strides[1] + low[2] * strides[2])
    x = np.uint64((high[0] - low[0]) * strides[0])
    y = np.uint64((high[1] - low[1]) * strides[1])
    z = np.uint64((high[2] - low[2]) * strides[2])
    near, far = place, place + x
    return (
        touched[near] & touched[near + z] & touched[near + y] & touched[near + y + z]
        & touched[far] & touched[far + z] & touched[far + y] & touched[far + y + z]
    )  # fmt: skip


@inline_kernel
def _mark_all(low, high, strides, touched):
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                touched[x * strides[0] + y * strides[1] + z * strides[2]] = True


@inline_kernel
def _rotate(t, w):
    """The cyclic rotation of a triple that puts component ``w`` last."""
    if w == 0:
        return t[1], t[2], t[0]
    if w == 1:
        return t[2], t[0], t[1]
    return t


@inline_kernel
def _dominant(p, q, r):
    """The axis along which the triangle's normal is longest."""
    nx = abs((q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1]))
    ny = abs((q[2] - p[2]) * (r[0] - p[0]) - (q[0] - p[0]) * (r[2] - p[2]))
    nz = abs((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))
    if nx >= ny and nx >= nz:
        return 0
    return 1 if ny >= nz else 2


@inline_kernel
def _in_grid(vertices, index, origin, scale):
    return (
        (vertices[index, 0] - origin[0]) * scale,
        (vertices[index, 1] - origin[1]) * scale,
        (vertices[index, 2] - origin[2]) * scale,
    )


def mark_all_triangles(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    origin: NDArray[np.float64],
    scale: float,
    touched: NDArray[np.bool_],
) -> None:
    """:func:`mark_triangles` of all ``faces``, on all threads."""
    a, b, c = touched.shape
    each = 2 * (a * b + b * c + c * a) // len(faces)  # voxels to a triangle, of a box's surface
    run_chunks(
        lambda begin, end: mark_triangles(vertices, faces, origin, scale, begin, end, touched),
        len(faces),
        least=-(-_LEAST_WORK // (1 + each)),
        chunks_per_thread=16,  # Ctrl-C is heard between chunks
    )


@kernel("float64[:, :], int32[:, :], float64[:], float64, int64, int64, bool[:, :, :]")
def mark_triangles(vertices, faces, origin, scale, begin, end, touched):
    """Set ``touched`` in every voxel that one of ``faces[begin:end]`` touches (closed sets).

    ``(vertices - origin) * scale`` lies in the grid: ``vertices`` (n, 3) float64, ``faces`` (m, 3)
    int32, ``origin`` (3,) float64, ``scale`` voxels a unit; ``touched`` (nx, ny, nz) bool.

    Separating axes in the form of Schwarz and Seidel, "Fast Parallel Surface and Solid
    Voxelization" (2010): a box meets a triangle when it meets its plane and, in each of the three
    axis projections, its three edges.  The plane is solved for the range on the triangle's dominant
    axis, so a large triangle costs the voxels of its footprint and not those of its bounding box.
    Threads may share ``touched``: it is only ever set.
    """
    sizes = touched.shape
    strides = (sizes[1] * sizes[2], sizes[2], 1)
    flat = touched.reshape(-1)
    for face in range(begin, end):
        p = _in_grid(vertices, faces[face, 0], origin, scale)
        q = _in_grid(vertices, faces[face, 1], origin, scale)
        r = _in_grid(vertices, faces[face, 2], origin, scale)
        x0, x1 = _span(p[0], q[0], r[0], sizes[0])
        y0, y1 = _span(p[1], q[1], r[1], sizes[1])
        z0, z1 = _span(p[2], q[2], r[2], sizes[2])
        low, high = (x0, y0, z0), (x1, y1, z1)
        is_small = max(x1 - x0, y1 - y0, z1 - z0) <= 1
        if is_small and _all_corners(low, high, strides, flat):
            continue
        thin = int(x0 == x1) + int(y0 == y1) + int(z0 == z1)
        if thin >= 2:
            # One row of voxels: a connected set that spans the row's ends touches all of it.
            _mark_all(low, high, strides, flat)
        elif thin == 1:
            w = 0 if x0 == x1 else 1 if y0 == y1 else 2
            _mark_layer(
                _rotate(p, w), _rotate(q, w), _rotate(r, w),
                _rotate(low, w), _rotate(high, w), _rotate(strides, w), flat,
            )  # fmt: skip
        else:
            w = _dominant(p, q, r)
            _mark_footprint(
                _rotate(p, w), _rotate(q, w), _rotate(r, w),
                _rotate(low, w), _rotate(high, w), _rotate(strides, w), flat,
            )  # fmt: skip


@kernel("bool[:, :, :], int64, int64, bool[:, :, :]")
def mark_cells(voxels, begin, end, touched):
    """Fill the rows ``begin:end`` of cells: one is touched where one of its voxels is.

    ``voxels`` (k nx, k ny, k nz) bool, of which ``touched`` (nx, ny, nz) bool has k a cell along
    each axis.
    """
    size = voxels.shape[0] // touched.shape[0]
    row = np.empty(voxels.shape[2], np.bool_)
    for i in range(begin, end):
        for j in range(touched.shape[1]):
            row[:] = False
            for x in range(i * size, i * size + size):
                for y in range(j * size, j * size + size):
                    _add_marks(voxels[x, y], row)
            for k in range(touched.shape[2]):
                found = False
                for z in range(k * size, k * size + size):
                    found |= row[z]
                touched[i, j, k] = found


@inner_kernel
def _add_marks(marks, row):
    for z in range(len(row)):
        row[z] |= marks[z]


@inline_kernel
def _all_below(low, high, strides, layers, limit):
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                if layers[x * strides[0] + y * strides[1] + z * strides[2]] > limit:
                    return False
    return True


@inline_kernel
def _cells_below(low, high, most, limit):
    """As :func:`_all_below` along the axes as they are, where strides would cost a fortieth of a
    terrain's run."""
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                if most[np.uint64(x), np.uint64(y), np.uint64(z)] > limit:
                    return False
    return True


@inline_kernel
def _barred_in(x, y, z, room):
    """The voxels of a cell that are above the limit, as ones of a word: voxel (i, j, k) of it is
    bit 16 i + 4 j + k.  They are looked at once: 64 lie in as many as 16 lines of memory."""
    layers, _, _, limit, barred, _ = room
    word = barred[x, y, z]
    if word == 0:  # threads that find the same at the same time write the same
        for i in range(_WORD):
            for j in range(_WORD):
                for k in range(_WORD):
                    above = layers[_WORD * x + i, _WORD * y + j, _WORD * z + k] > limit
                    word |= np.uint64(above) << np.uint64((i * _WORD + j) * _WORD + k)
        barred[x, y, z] = word
    return word


@inline_kernel
def _keeps_off(sides, low, high, is_row, word, w):
    """As :func:`_keeps_below` or, in a row, :func:`_all_below`, in one cell: by the word of the
    voxels that are above the limit.  Axes in cyclic order, ``w`` last."""
    ds, dt, dk = _rotate((_WORD * _WORD, _WORD, 1), w)
    column = np.uint64(1) | np.uint64(1) << np.uint64(dk)
    column |= column << np.uint64(2 * dk)
    last_of_cell = _WORD - 1
    for s in range(low[0], high[0] + 1):
        for t in range(low[1], high[1] + 1):
            place = (s & last_of_cell) * ds + (t & last_of_cell) * dt
            above = word >> np.uint64(place) & column
            if above == 0:
                continue
            first, last = low[2], high[2]
            if not is_row:
                first, last = _column(sides, s, t, low[2], high[2])
            for k in range(first, last + 1):
                if above >> np.uint64((k & last_of_cell) * dk) & np.uint64(1) != 0 and (
                    is_row or (_admit(sides[0], s, t) and _touches(sides, s, t, k))
                ):
                    return False
    return True


@inline_kernel
def _cell_contained(cell, fine, room, w):
    """Whether a triangle keeps to the limit in one cell that has voxels above it.

    ``cell`` and ``fine``, which are the triangle's sides in voxels, its box and whether that is a
    row of them, have their axes in cyclic order, ``w`` last; ``room`` as for :func:`is_contained`.
    """
    layers, least, _, limit, barred, _ = room
    x, y, z = _back(cell, w)
    if least[x, y, z] > limit:
        return False
    sides, low, high, is_row = fine
    sizes = layers.shape
    size = sizes[0] // least.shape[0]
    s, t, k = cell[0] * size, cell[1] * size, cell[2] * size
    low = (max(low[0], s), max(low[1], t), max(low[2], k))
    high = (min(high[0], s + size - 1), min(high[1], t + size - 1), min(high[2], k + size - 1))
    if len(barred) > 0:
        return _keeps_off(sides, low, high, is_row, _barred_in(x, y, z, room), w)
    strides = _rotate((sizes[1] * sizes[2], sizes[2], 1), w)
    if is_row:
        return _all_below(low, high, strides, layers.reshape(-1), limit)
    return _keeps_below(sides, low, high, strides, layers.reshape(-1), limit)


@inline_kernel
def _box(p, q, r, sizes, w):
    """First and last box of a grid of ``sizes`` along each axis of a triangle that is turned by
    ``w``, and whether all lie in one row: a connected set that spans its ends touches all of it."""
    sizes = _rotate(sizes, w)
    s0, s1 = _span(p[0], q[0], r[0], sizes[0])
    t0, t1 = _span(p[1], q[1], r[1], sizes[1])
    k0, k1 = _span(p[2], q[2], r[2], sizes[2])
    is_row = int(s0 == s1) + int(t0 == t1) + int(k0 == k1) >= 2
    return (s0, t0, k0), (s1, t1, k1), is_row


@inline_kernel
def _scaled(point, size):
    return point[0] * size, point[1] * size, point[2] * size


@inline_kernel
def _back(t, w):
    """What :func:`_rotate` turned, turned back."""
    if w == 0:
        return t[2], t[0], t[1]
    if w == 1:
        return t[1], t[2], t[0]
    return t


@inline_kernel
def _point_contained(point, room):
    """Whether a point's voxel is not above the limit."""
    layers, least, most, limit, barred, _ = room
    x, y, z = np.int64(point[0]), np.int64(point[1]), np.int64(point[2])
    if most[x, y, z] <= limit:  # of an array that is small enough for a cache
        return True
    size = layers.shape[0] // least.shape[0]
    i, j, k = (
        np.int64(point[0] * size), np.int64(point[1] * size), np.int64(point[2] * size)
    )  # fmt: skip
    if len(barred) > 0 and barred[x, y, z] != 0:
        bit = ((i - size * x) * _WORD + j - size * y) * _WORD + k - size * z
        return barred[x, y, z] >> np.uint64(bit) & np.uint64(1) == 0
    return layers[i, j, k] <= limit


@inner_kernel
def is_contained(p, q, r, room):
    """Whether a triangle touches no voxel of a layer above the limit.

    ``p``, ``q``, ``r`` are triples of float64 in grid space, whose unit is a cell.  ``room``:

    ``layers``  (k nx, k ny, k nz) uint8, the voxels: k a cell along each axis.
    ``least``, ``most``  (nx, ny, nz) uint8, the lowest and the highest layer in each cell.
    ``limit``   the highest layer that is allowed.
    ``barred``  (nx, ny, nz) uint64 where a cell has four voxels along each axis, else empty: zeros
                that are overwritten cell by cell, the room and its limit staying as they are.
    ``slab``    (5,) float64, as :func:`~simplifier.kernels.slab.keep_between` has it, which whoever
                moves a corner asks for; here it does not count.

    Outside the grid nothing is allowed.  Voxels are looked at only in cells that hold both kinds.
    """
    layers, _, most, limit, _, _ = room
    sizes = most.shape
    for axis in range(3):
        if min(p[axis], q[axis], r[axis]) <= _TOUCH:
            return False
        if max(p[axis], q[axis], r[axis]) >= sizes[axis] - _TOUCH:
            return False
    low, high, is_row = _box(p, q, r, sizes, 2)
    cells = (high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1)
    if cells <= _FEW_CELLS and _cells_below(low, high, most, limit):
        return True
    size = layers.shape[0] // sizes[0]
    a, b, c = _scaled(p, size), _scaled(q, size), _scaled(r, size)
    # Of triangles that leave the room most have a corner outside.
    for point in (p, q, r):
        if not _point_contained(point, room):
            return False
    one, other, _ = _box(a, b, c, layers.shape, 2)
    if one == other:
        return True  # a voxel that all corners are in
    w = _dominant(p, q, r)
    p, q, r = _rotate(p, w), _rotate(q, w), _rotate(r, w)
    a, b, c = _rotate(a, w), _rotate(b, w), _rotate(c, w)
    low, high = _rotate(low, w), _rotate(high, w)
    sides = _sides(p, q, r)
    fine = (_sides(a, b, c), *_box(a, b, c, layers.shape, w))
    strides, highest = _rotate((sizes[1] * sizes[2], sizes[2], 1), w), most.reshape(-1)
    for s in range(low[0], high[0] + 1):
        begun = False
        for t in range(low[1], high[1] + 1):
            first, last = low[2], high[2]
            if not is_row:
                if not _admit(sides[0], s, t):
                    if begun:
                        break  # an edge that once admits or refuses a square does so from there on
                    continue
                begun = True
                first, last = _column(sides, s, t, low[2], high[2])
            for k in range(first, last + 1):
                # Most cells are allowed as a whole, which takes less to see than what touches them.
                if highest[np.uint64(s * strides[0] + t * strides[1] + k * strides[2])] > limit:
                    touches = is_row or _touches(sides, s, t, k)
                    if touches and not _cell_contained((s, t, k), fine, room, w):
                        return False
    return True
