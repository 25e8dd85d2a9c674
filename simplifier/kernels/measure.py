"""The exact Euclidean distance transform, fused with its sum."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import kernel


@kernel
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
