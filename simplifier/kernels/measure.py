"""The exact Euclidean distance transform, fused with its sum.

Draw polygons of simplification chains into bit images and score them, many views at a time.

The polygons of all chains lie end to end: ``points`` (n, 2) float64 plane coordinates, ``lowest``
(n,) int32 as in :class:`simplifier.geometry.polygon.Chain`, ``offsets`` (p + 1,) int64 where each
begins.  ``maps`` (p, views, 6) float64 takes plane coordinates to pixels: x = m0 a + m1 b + m2,
y = m3 a + m4 b + m5.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import draw_edge, measure_twice
from simplifier.kernels.compiled.kernel import inner_kernel, kernel


@kernel("bool[:, :]")
def distance_sum(mask):
    """Sum over the pixels of ``mask`` of the distance to the shape's boundary, in pixels.

    ``mask`` (rows, columns) bool; outside the image is background.  The distance of a pixel is that
    of its centre to the nearest background centre, less half a pixel: the boundary runs between the
    two.  Summed, that is the trapezoid rule for equation (1) of the paper.

    Two passes, linear in the pixels: distances along columns, then along each row the lower
    envelope of the parabolas that they define (Meijster, Roerdink and Hesselink 2000).
    """
    rows, columns = mask.shape
    # One column of background on either side of each row.
    width = columns + 2
    heights = np.zeros((rows, width), np.int64)
    above = np.zeros(columns, np.int64)
    for row in range(rows):
        for column in range(columns):
            above[column] = above[column] + 1 if mask[row, column] else 0
            heights[row, column + 1] = above[column]
    above[:] = 0
    for row in range(rows - 1, -1, -1):
        for column in range(columns):
            above[column] = above[column] + 1 if mask[row, column] else 0
            heights[row, column + 1] = min(heights[row, column + 1], above[column])
    total = 0.0
    apexes = np.empty(width, np.int64)
    begins = np.empty(width, np.int64)
    for row in range(rows):
        line = heights[row]
        last = 0
        apexes[0] = 0
        begins[0] = 0
        for column in range(1, width):
            here = line[column] * line[column] + column * column
            while last >= 0:
                apex = apexes[last]
                at = begins[last]
                mine = (at - column) * (at - column) + line[column] * line[column]
                theirs = (at - apex) * (at - apex) + line[apex] * line[apex]
                if theirs <= mine:
                    break
                last -= 1
            if last < 0:
                last = 0
                apexes[0] = column
                begins[0] = 0
            else:
                apex = apexes[last]
                there = line[apex] * line[apex] + apex * apex
                begin = 1 + (here - there) // (2 * (column - apex))
                if begin < width:
                    last += 1
                    apexes[last] = column
                    begins[last] = begin
        for column in range(width - 1, -1, -1):
            if line[column] > 0:
                apex = apexes[last]
                square = (column - apex) * (column - apex) + line[apex] * line[apex]
                total += np.sqrt(float(square)) - 0.5
            if column == begins[last]:
                last -= 1
    return total


@inner_kernel
def gather_ring(points, lowest, begin, end, level, ring):
    """Copy the vertices of one level to ``ring``; return their number."""
    count = 0
    for i in range(begin, end):
        if lowest[i] <= level:
            ring[count, 0] = points[i, 0]
            ring[count, 1] = points[i, 1]
            count += 1
    return count


@inner_kernel
def draw_ring(ring, count, m, image):
    """Draw the projected ring into ``image`` (64,), which is cleared first."""
    for row in range(64):
        image[row] = 0
    x0 = m[0] * ring[count - 1, 0] + m[1] * ring[count - 1, 1] + m[2]
    y0 = m[3] * ring[count - 1, 0] + m[4] * ring[count - 1, 1] + m[5]
    for i in range(count):
        x1 = m[0] * ring[i, 0] + m[1] * ring[i, 1] + m[2]
        y1 = m[3] * ring[i, 0] + m[4] * ring[i, 1] + m[5]
        draw_edge(x0, y0, x1, y1, image)
        x0 = x1
        y0 = y1


@kernel("float64[:, :], int32[:], int64[:], float64[:, :, :], int64, int64, uint64[:, :]")
def draw_polygon(points, lowest, offsets, maps, polygon, level, images):
    """Write the (views, 64) uint64 ``images`` of one polygon at one level."""
    begin, end = offsets[polygon], offsets[polygon + 1]
    ring = np.empty((end - begin, 2))
    count = gather_ring(points, lowest, begin, end, level, ring)
    for view in range(images.shape[0]):
        draw_ring(ring, count, maps[polygon, view], images[view])


@kernel(
    "float64[:, :], int32[:], int64[:], float64[:, :, :], int32[:], int32[:], uint64[:, :], "
    "int64, int64, int64[:]"
)
def score_polygon_unions(points, lowest, offsets, maps, polygons, levels, base, begin, end, scores):
    """Twice the occlusion measure, summed over views, of ``base`` with each polygon added.

    ``polygons``, ``levels`` (k,) int32 name the polygons and levels to try, begin..end of them;
    ``base`` (views, 64) uint64; ``scores`` (k,) int64 is written.  Whole numbers, so the result
    does not depend on the order of summation.
    """
    image = np.zeros(64, np.uint64)
    longest = 0
    for i in range(begin, end):
        longest = max(longest, offsets[polygons[i] + 1] - offsets[polygons[i]])
    ring = np.empty((longest, 2))
    for i in range(begin, end):
        polygon = polygons[i]
        count = gather_ring(points, lowest, offsets[polygon], offsets[polygon + 1], levels[i], ring)
        score = np.int64(0)
        for view in range(base.shape[0]):
            draw_ring(ring, count, maps[polygon, view], image)
            for row in range(64):
                image[row] |= base[view, row]
            score += measure_twice(image)
        scores[i] = score


@kernel("uint64[:, :]")
def score_images(images):
    """Twice the occlusion measure summed over (views, 64) uint64 images, an int64."""
    score = np.int64(0)
    for view in range(images.shape[0]):
        score += measure_twice(images[view])
    return score


@kernel("uint64[:, :], int64[:]")
def score_each(images, scores):
    """Twice the occlusion measure of each of (views, 64) uint64 images, as ``scores`` (views,)."""
    for view in range(images.shape[0]):
        scores[view] = measure_twice(images[view])


@kernel("float64[:, :], float64[:], float64[:]")
def widen_ranges(rows, least, most):
    """Widen ``least`` and ``most`` (m,) float64 by each of the ``rows`` (n, m).

    In one pass and by whole rows: numpy takes six times as long for both.
    """
    for row in range(rows.shape[0]):
        for column in range(len(least)):
            value = rows[row, column]
            least[column] = min(least[column], value)
            most[column] = max(most[column], value)
