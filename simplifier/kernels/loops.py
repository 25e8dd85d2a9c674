"""Follow the cracks between covered and uncovered pixels."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel


@inner_kernel
def _follow(ink, x, y, loop, corners, count, started, left_loop):
    """Trace one loop from the lower edge of pixel (y, x), covered pixels on the left.

    Writes its corners from row ``count`` on.  Returns the new count, twice the signed area, and
    the covered pixel (row, column) left of the loop's leftmost upward crack.
    """
    start_x, start_y = x, y
    heading = 0  # +x, +y, -x, -y
    area = 0
    beside_row, beside_column = 0, ink.shape[1]
    turned = True
    while True:
        if turned:
            corners[count, 0] = x
            corners[count, 1] = y
            count += 1
        # One crack forward; then the pixels ahead on the left and on the right (``ink`` is padded).
        if heading == 0:
            started[y, x] = True
            area -= y
            x += 1
            left, right = ink[y + 1, x + 1], ink[y, x + 1]
        elif heading == 1:
            if x <= beside_column:
                beside_row, beside_column = y, x - 1
            area += x
            y += 1
            left, right = ink[y + 1, x], ink[y + 1, x + 1]
        elif heading == 2:
            area += y
            x -= 1
            left, right = ink[y, x], ink[y + 1, x]
        else:
            area -= x
            y -= 1
            left_loop[y, x] = loop
            left, right = ink[y, x + 1], ink[y, x]
        turned = True
        if not left:
            # Also where only the pixel on the right is covered: two covered pixels that meet at a
            # corner are not connected, each keeps its own corner.
            heading = (heading + 1) & 3
        elif right:
            heading = (heading + 3) & 3
        else:
            turned = False
        if x == start_x and y == start_y and heading == 0:
            return count, area, beside_row, beside_column


@kernel("bool[:, :], float64[:], float64")
def trace_loops(mask, corner, pixel):
    """All boundary loops of a mask.

    ``mask`` (rows, columns) bool; ``corner`` (2,) float64; ``pixel`` float.  Returns ``points``
    (n, 2) float64, ``starts`` (loops + 1,) int64, ``owner`` (loops,) int64: the outer loop that a
    hole lies in, or the loop itself when it is an outer one.  Only corners are kept.  Loops come
    in row-major order of the first pixel whose lower edge is theirs.
    """
    rows, columns = mask.shape
    # A border of one pixel on each side, and rows of whole words.
    words = (columns + 2 + 7) // 8
    ink = np.zeros((rows + 2, words * 8), np.uint8)
    for row in range(rows):
        for column in range(columns):
            ink[row + 1, column + 1] = mask[row, column]
    octets = ink.view(np.uint64)
    started = np.zeros((rows, columns), np.bool_)
    left_loop = np.empty((rows, columns), np.int32)
    # At most two corners at a lattice point, at least four in a loop.
    most = 2 * (rows + 1) * (columns + 1)
    corners = np.empty((most, 2), np.int32)
    starts = np.empty(most // 4 + 1, np.int64)
    beside = np.empty((most // 4, 2), np.int32)
    owner = np.empty(most // 4, np.int64)
    loops, count = 0, 0
    starts[0] = 0
    for row in range(rows):
        for word in range(words):
            if octets[row + 1, word] & ~octets[row, word] == 0:
                continue
            for column in range(max(8 * word - 1, 0), min(8 * word + 7, columns)):
                if started[row, column] or ink[row, column + 1] or not ink[row + 1, column + 1]:
                    continue
                count, area, beside[loops, 0], beside[loops, 1] = _follow(
                    ink, column, row, loops, corners, count, started, left_loop
                )
                owner[loops] = loops if area > 0 else -1
                loops += 1
                starts[loops] = count
    for loop in range(loops):
        # Leftwards through covered pixels from a hole's leftmost edge to a crack of the outer loop
        # or of a hole that begins further left: the columns decrease, so the walk ends.
        ancestor = loop
        while owner[ancestor] < 0:
            row, column = beside[ancestor, 0], beside[ancestor, 1]
            while ink[row + 1, column]:
                column -= 1
            ancestor = left_loop[row, column]
        owner[loop] = owner[ancestor]
    points = np.empty((count, 2), np.float64)
    for index in range(count):
        points[index, 0] = corner[0] + pixel * corners[index, 0]
        points[index, 1] = corner[1] + pixel * corners[index, 1]
    return points, starts[: loops + 1].copy(), owner[:loops].copy()
