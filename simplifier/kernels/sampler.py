"""Read the voxel grid at the pixel centres of planar sections.

The grid comes with one voxel of padding on all sides.  It takes the reads that the range of a row,
computed with rounding, has too many, so no pixel needs a test.  Along a row the point moves in
fixed point with 32 bits after the point, which costs less than converting three floats at every
pixel; its steps' rounding adds to 2e-7 voxel over the widest row of a 1024 grid.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, kernel

_BITS = 32
_ONE = 2.0**_BITS  # one voxel in fixed point
_SLACK = 1e-6  # columns by which a row's range may be too wide
_LEVEL = 1e-10  # voxels a column; rows that climb less count as level along that axis


@inline_kernel
def _inverse(step):
    return 1.0 / step if abs(step) > _LEVEL else 0.0


@inline_kernel
def _clip(start, inverse, size, first, last):
    """Those of the columns ``first`` to ``last`` (exclusive) where 0 <= start + c / inverse < size.

    Columns are whole numbers in float64; ``inverse`` is 0 for a level row.
    """
    if inverse == 0.0:
        return first, last if 0.0 <= start < size else first
    low = -start * inverse
    high = (size - start) * inverse
    if inverse < 0.0:
        low, high = high, low
    first = max(first, np.ceil(low - _SLACK))
    return first, max(first, min(last, np.floor(high + _SLACK) + 1.0))


@inline_kernel
def _enter_row(shape, frame, depth, row, dx, dy, dz, ix, iy, iz):
    """Range of the columns in the grid, and the fixed point where the first of them reads."""
    a = frame[9] + 0.5 * frame[11]
    b = frame[10] + (row + 0.5) * frame[11]
    x = frame[0] * a + frame[3] * b + frame[6] * depth
    y = frame[1] * a + frame[4] * b + frame[7] * depth
    z = frame[2] * a + frame[5] * b + frame[8] * depth
    first, last = _clip(x, ix, shape[0] - 2.0, 0.0, frame[13])
    first, last = _clip(y, iy, shape[1] - 2.0, first, last)
    first, last = _clip(z, iz, shape[2] - 2.0, first, last)
    # Voxel (0, 0, 0) lies one further on, behind the padding.
    at_x = np.int64((x + first * dx + 1.0) * _ONE)
    at_y = np.int64((y + first * dy + 1.0) * _ONE)
    at_z = np.int64((z + first * dz + 1.0) * _ONE)
    return np.int64(first), np.int64(last), at_x, at_y, at_z


@inline_kernel
def _fixed_point(step):
    return np.int64(np.floor(step * _ONE + 0.5))


@kernel("uint8[:, :, :], float64[:, :], int32[:], float64[:], int64, int64, int64[:]")
def slice_areas(padded, frames, frame_of, depths, begin, end, areas):
    """Covered pixels of planes begin..end.

    ``padded`` (nx + 2, ny + 2, nz + 2) uint8: 1 for an inside voxel, 0 elsewhere; ``frames``
    (f, 14) float64 rows: u, v, d, corner (2), pixel, rows, columns; ``frame_of`` (n,) int32;
    ``depths`` (n,) float64; ``areas`` (n,) int64 is written.
    """
    shape = padded.shape
    stride_x, stride_y = shape[1] * shape[2], shape[2]
    flat = padded.reshape(-1)
    for plane in range(begin, end):
        frame = frames[frame_of[plane]]
        dx, dy, dz = frame[0] * frame[11], frame[1] * frame[11], frame[2] * frame[11]
        ix, iy, iz = _inverse(dx), _inverse(dy), _inverse(dz)
        step_x, step_y, step_z = _fixed_point(dx), _fixed_point(dy), _fixed_point(dz)
        area = 0
        for row in range(np.int64(frame[12])):
            first, last, at_x, at_y, at_z = _enter_row(
                shape, frame, depths[plane], row, dx, dy, dz, ix, iy, iz
            )
            for _ in range(first, last):
                cell = (at_x >> _BITS) * stride_x + (at_y >> _BITS) * stride_y + (at_z >> _BITS)
                area += flat[np.uint64(cell)]
                at_x += step_x
                at_y += step_y
                at_z += step_z
        areas[plane] = area


@kernel("uint8[:, :, :], float64[:], float64, bool[:, :]")
def sample_plane(padded, frame, depth, mask):
    """Set the covered pixels of ``mask`` (rows, columns) bool; arguments as in :func:`slice_areas`.

    Reads the very voxels that :func:`slice_areas` counts.
    """
    dx, dy, dz = frame[0] * frame[11], frame[1] * frame[11], frame[2] * frame[11]
    ix, iy, iz = _inverse(dx), _inverse(dy), _inverse(dz)
    step_x, step_y, step_z = _fixed_point(dx), _fixed_point(dy), _fixed_point(dz)
    for row in range(np.int64(frame[12])):
        first, last, at_x, at_y, at_z = _enter_row(
            padded.shape, frame, depth, row, dx, dy, dz, ix, iy, iz
        )
        for c in range(first, last):
            mask[row, c] = padded[at_x >> _BITS, at_y >> _BITS, at_z >> _BITS]
            at_x += step_x
            at_y += step_y
            at_z += step_z
