"""Layers of voxels within and around a surface, in cells of k x k x k voxels.

``layers`` (k nx, k ny, k nz) uint8.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

INTERIOR, SURFACE, NEVER = 0, 1, 255
_UNKNOWN = 254  # until one side has reached it

SIX = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.int64)
"""Steps to the neighbours across a side."""


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
        row[z] = row[z] if row[z] == kept[z] else others[z]


@inline_kernel
def _position(place, sizes):
    """(x, y, z) of a flat index: once a voxel, as divisions cost more than all else here."""
    row = place // sizes[2]
    x = row // sizes[1]
    return x, row - x * sizes[1], place - row * sizes[2]


@inline_kernel
def _neighbour(x, y, z, step, sizes):
    """(whether it is in the array, its flat index) of the neighbour a step away."""
    x, y, z = x + step[0], y + step[1], z + step[2]
    there = 0 <= x < sizes[0] and 0 <= y < sizes[1] and 0 <= z < sizes[2]
    return there, (x * sizes[1] + y) * sizes[2] + z


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


@kernel("uint8[:, :, :], int64, int64, int64[:]")
def find_border(layers, begin, end, places):
    """Write the flat indices of the solid's voxels beside free ones, of rows ``begin:end``.

    Returns how many there are; no more than ``places`` holds are written.
    """
    sizes = layers.shape
    count = 0
    for x in range(begin, end):
        for y in range(sizes[1]):
            for z in range(sizes[2]):
                if layers[x, y, z] > SURFACE:
                    continue
                beside = (
                    (x > 0 and layers[x - 1, y, z] == NEVER)
                    or (x + 1 < sizes[0] and layers[x + 1, y, z] == NEVER)
                    or (y > 0 and layers[x, y - 1, z] == NEVER)
                    or (y + 1 < sizes[1] and layers[x, y + 1, z] == NEVER)
                    or (z > 0 and layers[x, y, z - 1] == NEVER)
                    or (z + 1 < sizes[2] and layers[x, y, z + 1] == NEVER)
                )
                if beside:
                    if count < len(places):
                        places[count] = (x * sizes[1] + y) * sizes[2] + z
                    count += 1
    return count


@kernel("uint8[:, :, :], int64[:], int64[:, :], int64")
def add_layer(layers, border, steps, layer):
    """Set the free voxels ``steps`` (n, 3) away from ``border`` (m,) to a layer; which they are."""
    sizes = layers.shape
    flat = layers.reshape(-1)
    shifts = np.empty(len(steps), np.int64)
    for number in range(len(steps)):
        step = steps[number]
        shifts[number] = (step[0] * sizes[1] + step[1]) * sizes[2] + step[2]
    found = np.empty(len(border) * 2 + 1024, np.int64)
    count = 0
    for place in border:
        if count + len(steps) > len(found):
            found = np.concatenate((found, np.empty(len(found), np.int64)))
        x, y, z = _position(place, sizes)
        within = 0 < x < sizes[0] - 1 and 0 < y < sizes[1] - 1 and 0 < z < sizes[2] - 1
        for number in range(len(steps)):
            there, other = within, place + shifts[number]
            if not within:
                there, other = _neighbour(x, y, z, steps[number], sizes)
            if there and flat[other] == NEVER:
                flat[other] = layer
                found[count] = other
                count += 1
    return found[:count].copy()


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
