"""Layers of voxels within and around a surface, in cells of k x k x k voxels.

``layers`` (k nx, k ny, k nz) uint8.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel

INTERIOR, SURFACE, NEVER = 0, 1, 255
_UNKNOWN = 254  # until one side has reached it


@kernel("bool[:, :, :], bool[:, :, :], int64, int64, uint8[:, :, :]")
def sort_cells(touched, filled, begin, end, layers):
    """Give the voxels of the cell rows ``begin:end`` a layer where the cell tells it.

    ``touched``, ``filled``  (nx, ny, nz) bool cells.  In a touched cell the voxels that are not
    :data:`SURFACE` wait for :func:`take_sides`.
    """
    size = layers.shape[0] // touched.shape[0]
    others, kept = np.empty((2, layers.shape[2]), np.uint8)
    for i in range(begin, end):
        for j in range(touched.shape[1]):
            for cell in range(touched.shape[2]):
                known = INTERIOR if filled[i, j, cell] else NEVER
                for z in range(cell * size, cell * size + size):
                    others[z] = _UNKNOWN if touched[i, j, cell] else known
                    kept[z] = SURFACE if touched[i, j, cell] else NEVER
            for x in range(i * size, i * size + size):
                for y in range(j * size, j * size + size):
                    _keep(layers[x, y], kept, others)


@inner_kernel
def _keep(row, kept, others):
    """The voxels of a row that are what is kept there stay, all others change."""
    for z in range(len(row)):
        here, other = row[z], others[z]  # both in any case, so that many are looked at at once
        row[z] = here if here == kept[z] else other


@kernel("bool[:, :, :], uint8[:, :, :]")
def take_sides(touched, layers):
    """Give each voxel that waits the side, inside or out, that reaches it first; inside if none.

    Both sides spread across voxels that the surface does not touch, a step at a time.  A closed
    surface keeps them apart; by a hole they meet half-way between.  No cell on the border of
    ``touched`` may be set, so that every voxel that waits has six neighbours.
    """
    size = layers.shape[0] // touched.shape[0]
    flat = layers.reshape(-1)
    row, plane = layers.shape[2], layers.shape[1] * layers.shape[2]
    steps = (plane, -plane, row, -row, 1, -1)
    corners = _first_voxels(touched, size, row, plane)
    total = 0
    for corner in corners:
        for x in range(0, size * plane, plane):
            for place in range(corner + x, corner + x + size * row, row):
                for index in range(place, place + size):
                    total += flat[index] == _UNKNOWN
    front = np.empty(total, np.int32)
    # First those beside a cell that is known: all of them, before any has got its side.
    sides = np.empty(total, np.uint8)
    ends = 0
    for corner in corners:
        for x in range(0, size * plane, plane):
            for place in range(corner + x, corner + x + size * row, row):
                for index in range(place, place + size):
                    if flat[index] != _UNKNOWN:
                        continue
                    side = _UNKNOWN
                    for step in steps:
                        other = flat[index + step]
                        if other in (INTERIOR, NEVER):
                            side = other
                    if side != _UNKNOWN:
                        front[ends], sides[ends] = index, side
                        ends += 1
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
    if ends == total:
        return
    for corner in corners:
        for x in range(0, size * plane, plane):
            for place in range(corner + x, corner + x + size * row, row):
                for index in range(place, place + size):
                    if flat[index] == _UNKNOWN:
                        flat[index] = INTERIOR


@inner_kernel
def _first_voxels(touched, size, row, plane):
    """(n,) int64 flat indices of the lowest voxels of touched cells; see :func:`take_sides`."""
    corners = np.empty(np.sum(touched), np.int64)
    count = 0
    for i in range(touched.shape[0]):
        for j in range(touched.shape[1]):
            for k in range(touched.shape[2]):
                if touched[i, j, k]:
                    corners[count] = size * (i * plane + j * row + k)
                    count += 1
    return corners


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
    one, two = np.full((2, size), NEVER, np.uint8)
    value = np.uint8(layer)
    for x in range(max(begin, 1), min(end, layers.shape[0] - 1)):
        before, plane = flat[(x - 1) * size : x * size], flat[x * size : (x + 1) * size]
        after = flat[(x + 1) * size : (x + 2) * size]
        if corners:
            _lowest(before, plane, after, one)
            _lowest(one, one[row:], one[2 * row :], two[row : size - row])
            _lowest(two, two[1:], two[2:], one[1 : size - 1])
            _set_free(one, one, value, plane)
        else:
            _lowest(before, after, after, one)
            _lowest(plane, plane[2 * row :], one[row:], two[row : size - row])
            _lowest(plane, plane[2:], plane[2:], one[1 : size - 1])
            _set_free(one, two, value, plane)


@inner_kernel
def _lowest(a, b, c, lowest):
    for i in range(len(lowest)):
        lowest[i] = min(a[i], b[i], c[i])


@inner_kernel
def _set_free(one, two, value, plane):
    """What is free, and where either of two rows is lower."""
    for i in range(len(plane)):
        beside = (plane[i] == np.uint8(NEVER)) & (min(one[i], two[i]) < value)
        plane[i] = value if beside else plane[i]


@kernel("uint8[:, :, :], int64, int64, uint8[:, :, :], uint8[:, :, :], uint8[:, :, :]")
def sum_cells(layers, begin, end, least, most, shares):
    """Fill the rows ``begin:end`` of three arrays (nx, ny, nz) of cells.

    ``least``, ``most``  uint8: the lowest and the highest layer in a cell.
    ``shares``           uint8: what is inside, a voxel on the surface counting half, in 254ths.
    """
    size = layers.shape[0] // least.shape[0]
    # Down the rows of a row of cells first: that is done for many voxels at once.
    lows, highs = np.empty((2, layers.shape[2]), np.uint8)
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
