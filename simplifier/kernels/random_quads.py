"""Random quads inside two masks: the sampled form of precision and recall (paper section 6.1).

Sums over all rectangles inside a mask: what random quads estimate, exactly.

Two corners drawn from a box give a rectangle of one column or row once and a wider one twice an
axis, so a rectangle of w x h pixels weighs m(w) m(h) with m(1) = 1 and m = 2 otherwise.

The rectangles that end on one row are swept with a stack, as for the largest rectangle under a
histogram: the height of a column is its run of ones upwards to the row.  A node of the stack is a
maximal interval of columns with the range of heights for which it is maximal; every rectangle
belongs to one node, and the sum over a node is a closed form.  A mask of n pixels has at most n
nodes, so the cost is linear, where counting quad by quad would be quadratic.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.faces import columns_of_word
from simplifier.kernels.threads import run_chunks

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


@inline_kernel
def _mix(state):
    """The output step of splitmix64 (Steele, Lea, Flood 2014): a bijection with good avalanche."""
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return state ^ (state >> np.uint64(31))


@inline_kernel
def _scale(bits, limit):
    """32 random bits to 0 .. limit - 1; the bias is below limit / 2^32."""
    return np.int64((bits * np.uint64(limit)) >> np.uint64(32))


@inline_kernel
def bit(mask, row, column):
    """1 where the pixel is covered, else 0 (uint64)."""
    return (mask[row, column >> 6] >> np.uint64(column & 63)) & np.uint64(1)


@inner_kernel
def bounding_box(mask, columns):
    """(first row, row end, first column, column end) of the covered pixels; all 0 when none is."""
    rows, words = mask.shape
    union = np.zeros(words, np.uint64)
    first_row = rows
    row_end = 0
    for row in range(rows):
        for word in range(words):
            if mask[row, word] != 0:
                first_row = min(first_row, row)
                row_end = row + 1
                union[word] |= mask[row, word]
    if row_end == 0:
        return 0, 0, 0, 0
    first_column = columns
    column_end = 0
    for column in range(columns):
        if (union[column >> 6] >> np.uint64(column & 63)) & np.uint64(1) != 0:
            first_column = min(first_column, column)
            column_end = column + 1
    return first_row, row_end, first_column, column_end


@inner_kernel
def _sum_table(original, occluder, box, table):
    """Summed-area tables of both masks over the box, in one word a place.

    ``table`` (> height, > width) uint64: original in the lower 32 bits, occluder in the upper.
    Differences of sums come out right in both halves, because the true counts are not negative and
    fit in 32 bits.
    """
    first_row, row_end, first_column, column_end = box
    for x in range(column_end - first_column + 1):
        table[0, x] = 0
    for row in range(first_row, row_end):
        y = row - first_row
        running = np.uint64(0)
        table[y + 1, 0] = 0
        for column in range(first_column, column_end):
            both = bit(original, row, column) | (bit(occluder, row, column) << np.uint64(32))
            running += both
            x = column - first_column + 1
            table[y + 1, x] = table[y, x] + running


@kernel("uint64[:, :, :], uint64[:, :, :], int64, int64, uint64, uint64, int64, int64, int64[:, :]")
def sample_quads(originals, occluders, columns, quads, seed, first_view, begin, end, pixels):
    """Fill ``pixels[begin:end]`` with the pixel sums (Nt, Pf, Nf) of ``quads`` random quads.

    ``originals``, ``occluders``  (V, rows, words) uint64.
    ``seed``, ``first_view``      uint64; view v of the arrays draws the numbers of view
                                  first_view + v: they depend on (seed, view, quad) alone.
    ``pixels``                    (V, 3) int64.
    """
    rows = originals.shape[1]
    table = np.empty((rows + 1, columns + 1), np.uint64)
    low_half = np.uint64(0xFFFFFFFF)
    for view in range(begin, end):
        box = bounding_box(originals[view], columns)
        height = box[1] - box[0]
        width = box[3] - box[2]
        true_positive = 0
        missed = 0
        wrong = 0
        if height > 0:
            _sum_table(originals[view], occluders[view], box, table)
            state = _mix(_mix(seed + _GOLDEN) + (first_view + np.uint64(view)) * _GOLDEN)
            for _ in range(quads):
                state += _GOLDEN
                across = _mix(state)
                state += _GOLDEN
                along = _mix(state)
                x0 = _scale(across & low_half, width)
                x1 = _scale(across >> np.uint64(32), width)
                y0 = _scale(along & low_half, height)
                y1 = _scale(along >> np.uint64(32), height)
                left = min(x0, x1)
                right = max(x0, x1) + 1
                low = min(y0, y1)
                high = max(y0, y1) + 1
                count = (
                    table[high, right] - table[low, right] - table[high, left] + table[low, left]
                )
                area = (right - left) * (high - low)
                in_original = np.int64(count & low_half)
                in_occluder = np.int64(count >> np.uint64(32))
                if in_original == area:
                    if in_occluder == area:
                        true_positive += area
                    else:
                        missed += area
                elif in_occluder == area:
                    wrong += area - in_original
        pixels[view, 0] = true_positive
        pixels[view, 1] = missed
        pixels[view, 2] = wrong


def sampled_quad_pixels(
    original: NDArray[np.uint64],
    occluder: NDArray[np.uint64],
    columns: int,
    *,
    quads: int,
    seed: int,
    first_view: int = 0,
) -> NDArray[np.float64]:
    """(V, 3) float64: mean Nt, Pf and Nf of ``quads`` random quads a view, pixels a quad.

    ``original``, ``occluder``  (V, rows, words) bit rows of :mod:`simplifier.kernels.coverage`.
    ``seed``                    0 .. 2^64 - 1; a quad depends on (seed, view, number of the quad)
                                alone, so neither threads nor blocks of views change the result:
                                view i of the arrays is view ``first_view`` + i.
    """
    pixels = np.zeros((len(original), 3), dtype=np.int64)
    run_chunks(
        lambda begin, end: sample_quads(
            original,
            occluder,
            columns,
            quads,
            np.uint64(seed),
            np.uint64(first_view),
            begin,
            end,
            pixels,
        ),
        len(original),
    )
    return np.asarray(pixels / quads)


def mean_quad_areas(original: NDArray[np.uint64]) -> NDArray[np.float64]:
    """(V,) float64: pixels of a random quad of each view, filled or not; 0 where nothing shows.

    ``original``  (V, rows, words) bit rows of :mod:`simplifier.kernels.coverage`.
    """
    rows = np.asarray(original.any(axis=2))
    words = np.ascontiguousarray(np.bitwise_or.reduce(original, axis=1))
    columns = np.unpackbits(words.astype("<u8").view(np.uint8), axis=1, bitorder="little")
    return mean_areas(_extent(rows), _extent(columns.astype(bool)))


def mean_areas(rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
    """(V,) float64: pixels of a random quad in boxes of so many rows and columns, each (V,).

    Two corners drawn from n places are (n - 1 / n) / 3 apart in the mean.
    """
    lengths = []
    for one in (rows, columns):
        places = one.astype(np.float64)
        between = (places - 1.0 / np.maximum(places, 1.0)) / 3.0 + 1.0
        lengths.append(np.where(places > 0.0, between, 0.0))
    return np.asarray(lengths[0] * lengths[1])


def _extent(covered: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(V,) places of (V, n) from the first to the last that is covered; 0 where none is."""
    first, last = covered.argmax(axis=1), covered.shape[1] - 1 - covered[:, ::-1].argmax(axis=1)
    return np.where(covered.any(axis=1), last - first + 1, 0)


def exact_quad_pixels(
    original: NDArray[np.uint64],
    occluder: NDArray[np.uint64],
    columns: int,
    full: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """(V, 3) float64: the expectation of Nt, Pf and Nf for one quad a view, pixels.

    ``original``, ``occluder``  (V, rows, words) bit rows of :mod:`simplifier.kernels.coverage`.
    ``full``  (V,) :func:`full_areas` of the original, for callers who judge several occluders.
    What :func:`sampled_quad_pixels` tends to with more quads, at
    about the same cost.
    """
    full = full_areas(original, columns) if full is None else full
    pixels = np.zeros((len(original), 3), dtype=np.float64)
    run_chunks(
        lambda begin, end: count_rectangles(original, full, occluder, columns, begin, end, pixels),
        len(original),
    )
    return pixels


def full_areas(masks: NDArray[np.uint64], columns: int) -> NDArray[np.float64]:
    """(V,) float64: the area of all rectangles of pixels that lie in each of the masks (V, rows,
    words), each as often as a quad is drawn that is it."""
    areas = np.zeros(len(masks), dtype=np.float64)
    run_chunks(lambda begin, end: add_up_full(masks, columns, begin, end, areas), len(masks))
    return areas


@inline_kernel
def _weighted_widths(length):
    """Sum of m(w) w over the intervals of a run: sum over w of (length - w + 1) m(w) w."""
    return length * (length + 1) * (length + 2) // 3 - length


@inline_kernel
def _weighted_heights(height):
    """Sum of m(h) h for h = 1 .. height."""
    return height * height + height - 1 if height > 0 else 0


@inline_kernel
def _words(box):
    """The first word with columns of the box, and the one after the last."""
    return box[2] >> 6, (box[3] + 63) >> 6


@inline_kernel
def _go_on(row, word, here, before, runs, begun):
    """Follow the runs of ones upwards to a row, of which ``here`` is a word and ``before`` the one
    before.

    ``runs`` (3, words) uint64: the bits of the row, where a column's run is not as high as that of
    the one before, and scratch; ``begun`` (columns,) int64 is the row in which each began.
    """
    beginning = here & ~runs[0, word]
    while beginning != 0:
        one, place = lowest_one(beginning)
        beginning ^= one
        begun[64 * word + place] = row
    shifted = (here << np.uint64(1)) | (before >> np.uint64(63))
    runs[0, word] = here
    runs[1, word] = (here ^ shifted) | (here & shifted & runs[1, word])


@inline_kernel
def _next_level(levels, top, height):
    """The height down to which a level that is taken off goes: that of the level below, or the
    ``height`` of what comes."""
    return max(height, levels[top - 1]) if top > 0 else height


@inner_kernel
def _full_area(first, second, box, runs, begun, starts, levels):
    """Weighted area of the rectangles that lie in both masks and in the box, as float64.

    Whole numbers throughout; a row's sum fits int64 for images up to 4096 pixels a side, and the
    total is exact while it is below 2^53 (images up to about 500 pixels).  Columns as high as the
    one before change nothing, and are not looked at.
    """
    begin, end = _words(box)
    runs[:] = 0
    total = 0.0
    for row in range(box[0], box[1]):
        before = np.uint64(0)
        for word in range(begin, end):
            here = first[row, word] & second[row, word] & columns_of_word(box[2], box[3], word)
            _go_on(row, word, here, before, runs, begun)
            before = here
        sum_of_row = 0
        top = 0
        for word in range(begin, end + 1):
            # After the last column all that is left ends.
            events = runs[1, word] if word < end else np.uint64(1)
            while events != 0:
                one, place = lowest_one(events)
                events ^= one
                x, height = box[3], 0
                if word < end:
                    x = 64 * word + place
                    if runs[0, word] & one != 0:
                        height = row - begun[x] + 1
                start = x
                while top > 0 and levels[top - 1] > height:
                    top -= 1
                    start = starts[top]
                    below = _next_level(levels, top, height)
                    sum_of_row += _weighted_widths(x - start) * (
                        _weighted_heights(levels[top]) - _weighted_heights(below)
                    )
                if height > 0 and (top == 0 or levels[top - 1] < height):
                    starts[top] = start
                    levels[top] = height
                    top += 1
        total += sum_of_row
    return total


@inner_kernel
def _extend(now, past, sums, moments):
    for x in range(len(moments)):
        moments[x] = 2 * now[x] - past[x] + sums[x]


@inner_kernel
def _outside_moments(original, occluder, box, sums, moments):
    """Twice-summed moments of the occluder's pixels outside the original, from the first row on
    that has any, which is returned; the box's last where none has.

    ``moments`` (height + 2, 3, width + 1) int64: with S[y][k][x] the sum of column^k over the
    outside pixels in the first y rows and x columns, moments[y] = S[0] + ... + S[y - 1].  The
    second sum turns a range of heights into two lookups.  ``sums`` (3, width + 1) is scratch.
    """
    begin, end = _words(box)
    width = box[3] - box[2]
    first = box[1]
    moments[:2] = 0
    for row in range(box[0], box[1]):
        sums[:] = 0
        outside = False
        for word in range(begin, end):
            bits = (
                occluder[row, word] & ~original[row, word] & columns_of_word(box[2], box[3], word)
            )
            while bits != 0:
                one, place = lowest_one(bits)
                bits ^= one
                x = 64 * word + place - box[2]
                sums[0, x + 1] = 1
                sums[1, x + 1] = x
                sums[2, x + 1] = x * x
                outside = True
        if outside:
            first = min(first, row)
            for k in range(3):
                for x in range(width):
                    sums[k, x + 1] += sums[k, x]
        y = row - first
        if y < 0:
            continue
        # S[y + 1] = S[y] + this row; moments[y + 2] = moments[y + 1] + S[y + 1].
        for k in range(3):
            _extend(moments[y + 1, k], moments[y, k], sums[k], moments[y + 2, k, : width + 1])
    return first


@inline_kernel
def _height_sum(moments, y, x, k, below, height):
    """Sum of m(h) (S[y] - S[y - h]) for below < h <= height, at column x and moment k."""
    here = moments[y + 1, k, x] - moments[y, k, x]
    past = moments[max(y - below, 0), k, x] - moments[max(y - height, 0), k, x]
    total = 2 * ((height - below) * here - past)
    if below == 0:
        total -= here - (moments[y, k, x] - moments[y - 1, k, x])
    return total


@inline_kernel
def _node_outside(moments, y, start, end, below, height):
    """Weighted outside pixels of one node: intervals of columns start .. end - 1.

    Column c lies in 2 (c - start + 1) (end - c) - 1 of them, weights included: a quadratic in c,
    hence the three moments.  All terms stay below 2^63 for images up to 4096 pixels a side.
    """
    m0 = _height_sum(moments, y, end, 0, below, height)
    m0 -= _height_sum(moments, y, start, 0, below, height)
    m1 = _height_sum(moments, y, end, 1, below, height)
    m1 -= _height_sum(moments, y, start, 1, below, height)
    m2 = _height_sum(moments, y, end, 2, below, height)
    m2 -= _height_sum(moments, y, start, 2, below, height)
    return -2 * m2 + 2 * (start - 1 + end) * m1 - (2 * (start - 1) * end + 1) * m0


@inner_kernel
def _outside_pixels(
    original, occluder, box, first, moments, runs, begun, latest, starts, levels, youngest
):
    """Weighted pixels outside the original of the rectangles that lie in the occluder, float64.

    ``first`` and ``moments`` as of :func:`_outside_moments`.  ``latest`` holds the row of a
    column's last outside pixel: a node whose youngest is at least as old as the node is high has
    none, and most nodes have none.  So of columns as high as the one before only those count whose
    run has one, and no row without any.
    """
    begin, end = _words(box)
    runs[:] = 0
    total = 0.0
    for row in range(box[0], box[1]):
        before, any_outside = np.uint64(0), np.uint64(0)
        for word in range(begin, end):
            here = occluder[row, word] & columns_of_word(box[2], box[3], word)
            _go_on(row, word, here, before, runs, begun)
            before = here
            outside = here & ~original[row, word]
            runs[2, word] = (runs[2, word] & here) | outside
            any_outside |= runs[2, word]
            while outside != 0:
                one, place = lowest_one(outside)
                outside ^= one
                latest[64 * word + place] = row
        if any_outside == 0:
            continue
        y = row - first + 1
        sum_of_row = 0
        top = 0
        for word in range(begin, end + 1):
            # After the last column all that is left ends.
            events = runs[1, word] | runs[2, word] if word < end else np.uint64(1)
            while events != 0:
                one, place = lowest_one(events)
                events ^= one
                x, height, age = box[3], 0, box[1]
                if word < end:
                    x = 64 * word + place
                    if runs[0, word] & one != 0:
                        height = row - begun[x] + 1
                    if runs[2, word] & one != 0:
                        age = row - latest[x]
                start = x
                while top > 0 and levels[top - 1] > height:
                    top -= 1
                    start = starts[top]
                    below = _next_level(levels, top, height)
                    if top > 0:
                        youngest[top - 1] = min(youngest[top - 1], youngest[top])
                    if youngest[top] < levels[top]:
                        sum_of_row += _node_outside(
                            moments, y, start - box[2], x - box[2], below, levels[top]
                        )
                    age = min(age, youngest[top])
                if height > 0:
                    if top == 0 or levels[top - 1] < height:
                        starts[top] = start
                        levels[top] = height
                        youngest[top] = age
                        top += 1
                    else:
                        youngest[top - 1] = min(youngest[top - 1], age)
        total += sum_of_row
    return total


@kernel("uint64[:, :, :], int64, int64, int64, float64[:]")
def add_up_full(masks, columns, begin, end, areas):
    """Fill ``areas[begin:end]`` (V,) float64 as :func:`full_areas` does."""
    runs = np.empty((3, masks.shape[2]), np.uint64)
    stacks = np.empty((3, columns + 1), np.int64)
    begun, starts, levels = stacks[0], stacks[1], stacks[2]
    for view in range(begin, end):
        box = bounding_box(masks[view], columns)
        areas[view] = 0.0
        if box[1] > 0:
            areas[view] = _full_area(masks[view], masks[view], box, runs, begun, starts, levels)


@kernel("uint64[:, :, :], float64[:], uint64[:, :, :], int64, int64, int64, float64[:, :]")
def count_rectangles(originals, full, occluders, columns, begin, end, pixels):
    """Fill ``pixels[begin:end]`` with the expected (Nt, Pf, Nf) of one quad.

    ``originals``, ``occluders`` (V, rows, words) uint64, ``full`` (V,) float64 the originals'
    :func:`full_areas`, ``pixels`` (V, 3) float64.  Needs 24 bytes a pixel of scratch memory a
    thread.
    """
    moments = np.empty((originals.shape[1] + 2, 3, columns + 1), np.int64)
    sums = np.empty((3, columns + 1), np.int64)
    runs = np.empty((3, originals.shape[2]), np.uint64)
    stacks = np.empty((5, columns + 1), np.int64)
    begun, latest, starts = stacks[0], stacks[1], stacks[2]
    levels, youngest = stacks[3], stacks[4]
    for view in range(begin, end):
        original = originals[view]
        occluder = occluders[view]
        box = bounding_box(original, columns)
        pixels[view] = 0.0
        if box[1] == 0:
            continue
        pairs = (float(box[1] - box[0]) * float(box[3] - box[2])) ** 2
        shared = _full_area(original, occluder, box, runs, begun, starts, levels)
        pixels[view, 0] = shared / pairs
        pixels[view, 1] = (full[view] - shared) / pairs
        first = _outside_moments(original, occluder, box, sums, moments)
        if first < box[1]:
            outside = _outside_pixels(
                original, occluder, box, first, moments, runs, begun, latest, starts, levels,
                youngest,
            )  # fmt: skip
            pixels[view, 2] = outside / pairs
