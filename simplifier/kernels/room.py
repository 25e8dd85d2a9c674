"""Layers of voxels within and around a surface, in cells of k x k x k voxels.

``layers`` (k nx, k ny, k nz) uint8.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

INTERIOR, SURFACE, NEVER = 0, 1, 255
_UNKNOWN = 254  # until one side has reached it
_NONE_KNOWN = (_UNKNOWN,) * 6  # of the cells around one


@kernel("bool[:, :, :], bool[:, :, :], bool[:, :, :], int64, int64, int64, uint8[:, :, :]")
def sort_cells(touched, filled, surface, around, begin, end, layers):
    """Give the voxels of the cell rows ``begin:end`` a layer where the cell tells it.

    ``touched``, ``filled``  (nx, ny, nz) bool cells.  In a touched cell the voxels that are not
    :data:`SURFACE` wait for :func:`take_sides`.
    ``surface``  bool voxels that are touched, of the grid that lies ``around`` voxels within that
    of ``layers`` on all sides; it may be the memory of ``layers``.
    """
    size = layers.shape[0] // touched.shape[0]
    others = np.empty(layers.shape[2], np.uint8)
    for i in range(begin, end):
        for j in range(touched.shape[1]):
            for cell in range(touched.shape[2]):
                known = _known(touched, filled, i, j, cell)
                for z in range(cell * size, cell * size + size):
                    others[z] = known
            for x in range(i * size, i * size + size):
                for y in range(j * size, j * size + size):
                    row, u, v = layers[x, y], x - around, y - around
                    if 0 <= u < surface.shape[0] and 0 <= v < surface.shape[1]:
                        _sort_row(surface[u, v], others, around, row)
                    else:
                        _copy(others, row)


@inline_kernel
def _known(touched, filled, i, j, k):
    """The layer of the voxels of a cell, where the cell tells it."""
    if touched[i, j, k]:
        return _UNKNOWN
    return INTERIOR if filled[i, j, k] else NEVER


@inner_kernel
def _sort_row(surface, others, around, row):
    """What waits is on the surface where that is set; the rest is as others have it."""
    for z in range(around):
        row[z] = others[z]
    within, beside = row[around:], others[around:]
    for z in range(len(surface)):
        here, other = surface[z], beside[z]  # both in any case, so that many are looked at at once
        within[z] = np.uint8(SURFACE) if here & (other == np.uint8(_UNKNOWN)) else other
    for z in range(around + len(surface), len(row)):
        row[z] = others[z]


@inner_kernel
def _copy(values, row):
    for z in range(len(row)):
        row[z] = values[z]


@kernel("bool[:, :, :], bool[:, :, :], uint8[:, :, :]")
def take_sides(touched, filled, layers):
    """Give each voxel that waits the side, inside or out, that reaches it first.

    Both sides spread across voxels that the surface does not touch, a step at a time.  A closed
    surface keeps them apart; by a hole they meet half-way between.  What neither reaches is left to
    :func:`fill_rest`.  No cell on the border of ``touched`` may be set, so that every voxel that
    waits has six neighbours.
    """
    size = layers.shape[0] // touched.shape[0]
    flat = layers.reshape(-1)
    row, plane = layers.shape[2], layers.shape[1] * layers.shape[2]
    steps = (plane, -plane, row, -row, 1, -1)
    front = np.empty(np.sum(touched) * size**3, np.int32)
    # First those beside a cell that is known: all of them, before any has got its side.
    sides = np.empty(len(front), np.uint8)
    ends = 0
    for i in range(touched.shape[0]):
        for j in range(touched.shape[1]):
            for k in range(touched.shape[2]):
                if not touched[i, j, k]:
                    continue
                beside = (
                    _known(touched, filled, i + 1, j, k), _known(touched, filled, i - 1, j, k),
                    _known(touched, filled, i, j + 1, k), _known(touched, filled, i, j - 1, k),
                    _known(touched, filled, i, j, k + 1), _known(touched, filled, i, j, k - 1),
                )  # fmt: skip
                if beside != _NONE_KNOWN:
                    corner = size * (i * plane + j * row + k)
                    ends = _take_faces(flat, corner, size, steps, beside, front, sides, ends)
    for number in range(ends):
        flat[front[number]] = sides[number]
    done = 0
    while done < ends:
        place = front[done]
        done += 1
        side = flat[place]
        for step in steps:
            if flat[place + step] == _UNKNOWN:
                flat[place + step] = side
                front[ends] = place + step
                ends += 1


@inner_kernel
def _take_faces(flat, corner, size, steps, beside, front, sides, ends):
    """Add the voxels of a cell that wait beside a known one, and the side of the last such; see
    :func:`take_sides`, of which ``ends`` is how many there are."""
    last = size - 1
    for x in range(size):
        for y in range(size):
            for z in range(size):
                index = corner + x * steps[0] + y * steps[2] + z
                side = _UNKNOWN
                if x == last and beside[0] != _UNKNOWN:
                    side = beside[0]
                if x == 0 and beside[1] != _UNKNOWN:
                    side = beside[1]
                if y == last and beside[2] != _UNKNOWN:
                    side = beside[2]
                if y == 0 and beside[3] != _UNKNOWN:
                    side = beside[3]
                if z == last and beside[4] != _UNKNOWN:
                    side = beside[4]
                if z == 0 and beside[5] != _UNKNOWN:
                    side = beside[5]
                if side != _UNKNOWN and flat[index] == _UNKNOWN:
                    front[ends], sides[ends] = index, side
                    ends += 1
    return ends


@kernel("bool[:, :, :], int64, int64, uint8[:, :, :]")
def fill_rest(touched, begin, end, layers):
    """Make the voxels of the cell rows ``begin:end`` inside that still wait."""
    size = layers.shape[0] // touched.shape[0]
    for i in range(begin, end):
        for j in range(touched.shape[1]):
            for k in range(touched.shape[2]):
                if not touched[i, j, k]:
                    continue
                for x in range(i * size, i * size + size):
                    for y in range(j * size, j * size + size):
                        row = layers[x, y, k * size : k * size + size]
                        for z in range(size):
                            layer = row[z]
                            row[z] = np.uint8(INTERIOR) if layer == np.uint8(_UNKNOWN) else layer


@kernel("uint8[:, :, :], int64, int64, bool, int64")
def add_layer(layers, begin, end, corners, layer):
    """Set the free voxels of the planes ``begin:end`` that are beside a lower layer to this one.

    ``corners``  whether those across an edge or a corner are beside it, too.

    The outermost voxels are free, and none beside them may be lower.  Threads may share ``layers``:
    nothing that is written meanwhile is lower.  Voxels of a plane are looked at in one row, which
    is done for many at once.
    """
    size, row = layers.shape[1] * layers.shape[2], layers.shape[2]
    flat = layers.reshape(-1)
    lowest = np.full(size, NEVER, np.uint8)
    value = np.uint8(layer)
    for x in range(max(begin, 1), min(end, layers.shape[0] - 1)):
        before, plane = flat[(x - 1) * size : x * size], flat[x * size : (x + 1) * size]
        after = flat[(x + 1) * size : (x + 2) * size]
        if corners:
            _lowest_across(before, plane, after, lowest)
            _set_near(lowest, row, value, plane)
        else:
            _lowest_beside(before, plane, after, row, lowest)
            _set_free(lowest, value, plane)


@inner_kernel
def _lowest_across(before, plane, after, lowest):
    for i in range(len(plane)):
        lowest[i] = min(before[i], plane[i], after[i])


@inner_kernel
def _set_near(lowest, row, value, plane):
    """What is free and has a lower one among the nine around it, of which ``lowest`` tells."""
    up, down = lowest[: len(plane) - 2 * row], lowest[2 * row :]
    middle, free = lowest[row : len(plane) - row], plane[row : len(plane) - row]
    for i in range(1, len(free) - 1):
        least = min(up[i - 1], up[i], up[i + 1], middle[i - 1], middle[i], middle[i + 1])
        least = min(least, down[i - 1], down[i], down[i + 1])
        free[i] = _lowered(free[i], least, value)


@inner_kernel
def _lowest_beside(before, plane, after, row, lowest):
    up, down, middle = (
        plane[: len(plane) - 2 * row],
        plane[2 * row :],
        plane[row : len(plane) - row],
    )
    front, back = before[row : len(plane) - row], after[row : len(plane) - row]
    within = lowest[row : len(plane) - row]
    for i in range(1, len(middle) - 1):
        least = min(front[i], back[i], up[i], down[i])
        within[i] = min(least, middle[i - 1], middle[i + 1])


@inner_kernel
def _set_free(lowest, value, plane):
    """What is free, and where one beside it is lower."""
    for i in range(len(plane)):
        plane[i] = _lowered(plane[i], lowest[i], value)


@inline_kernel
def _lowered(layer, least, value):
    """What a voxel becomes that has such a one beside it."""
    return value if (layer == np.uint8(NEVER)) & (least < value) else layer


@kernel("uint8[:, :, :], int64, int64, uint8[:, :, :], uint8[:, :, :], uint8[:, :, :]")
def sum_cells(layers, begin, end, least, most, shares):
    """Fill the rows ``begin:end`` of three arrays (nx, ny, nz) of cells.

    ``least``, ``most``  uint8: the lowest and the highest layer in a cell.
    ``shares``           uint8: what is inside, a voxel on the surface counting half, in 254ths.
    """
    size = layers.shape[0] // least.shape[0]
    # Down the rows of a row of cells first: that is done for many voxels at once.
    lows, highs = np.empty(layers.shape[2], np.uint8), np.empty(layers.shape[2], np.uint8)
    sums = np.empty(layers.shape[2], np.uint16)
    for i in range(begin, end):
        for j in range(least.shape[1]):
            lows[:], highs[:], sums[:] = 255, 0, 0
            for x in range(i * size, i * size + size):
                for y in range(j * size, j * size + size):
                    _add_row(layers[x, y], lows, highs)
                    _add_inside(layers[x, y], sums)
            for k in range(least.shape[2]):
                low, high, halves = np.uint8(255), np.uint8(0), 0
                for z in range(k * size, k * size + size):
                    low, high = min(low, lows[z]), max(high, highs[z])
                    halves += np.int64(sums[z])
                least[i, j, k], most[i, j, k] = low, high
                shares[i, j, k] = 127 * halves // size**3


@inner_kernel
def _add_row(row, lows, highs):
    """The least and the most by column."""
    for z in range(len(row)):
        lows[z] = min(lows[z], row[z])
        highs[z] = max(highs[z], row[z])


@inner_kernel
def _add_inside(row, sums):
    """What is inside by column, in halves: two loops, each of few arrays, are vectorized."""
    for z in range(len(row)):
        sums[z] += np.uint16(2) - min(np.uint16(row[z]), np.uint16(2))
