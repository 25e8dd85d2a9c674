"""A flight just above the roofs: a figure of eight across the scene."""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from simplifier.camera_paths.columns import Columns, UprightScene, columns_of
from simplifier.geometry.mesh import FloatArray

_COLUMNS = 1000  # along the longer side
_FINEST = 0.15  # a column's edge, eye heights
_ABOVE = 3.0  # over the roofs, eye heights
_WIDE = 0.36  # half the width of the eight, in extents of the scene
_EVEN = 5.0  # over how far rises and falls are evened out, eye heights


def roof_flight(
    upright: UprightScene, frames: int, eye: float, rng: np.random.Generator
) -> FloatArray:
    """(frames, 3) places, upright space, ``3 eye`` or more above all that is below them.

    So are the straight lines between them: each frame is at least as high over the ground as the
    highest roof up to its neighbours asks for.
    """
    extent = upright.extent
    cell = max(float(extent[:2].max()) / _COLUMNS, _FINEST * eye)
    columns = columns_of(upright, np.zeros(2), extent[:2], cell)
    flat = _figure(extent[:2], frames, rng)
    step = float(np.linalg.norm(np.diff(flat, axis=0), axis=1).max(initial=0.0))
    parts = max(math.ceil(step / cell), 1)
    dense = _subdivide(flat, parts)
    x, y = columns.cells_of(dense).T
    # Over more than all places all heights are one, and an eye may be higher than any number.
    even = round(min(_EVEN * eye * parts / step, len(dense))) if step > 0.0 else 0
    # The highest within a step and an even, then a mean within an even: nowhere less than the
    # highest within a step.
    highest = ndimage.maximum_filter1d(_roofs(columns)[x, y], 2 * (parts + even) + 1)
    heights = ndimage.uniform_filter1d(highest, 2 * even + 1, mode="nearest")
    return np.column_stack([flat, heights[::parts] + _ABOVE * eye])


def _figure(extent: FloatArray, frames: int, rng: np.random.Generator) -> FloatArray:
    """(frames, 2) places in equal steps along most of a turned figure of eight."""
    start = 2.0 * math.pi * rng.random()
    phase = start + 0.95 * 2.0 * math.pi * np.linspace(0.0, 1.0, 4096)
    long = int(extent[1] > extent[0])
    curve = np.empty((len(phase), 2))
    curve[:, long] = np.sin(phase)
    curve[:, 1 - long] = np.sin(2.0 * phase)
    curve = extent * (0.5 + _WIDE * curve)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], frames)
    return np.column_stack([np.interp(wanted, along, column) for column in curve.T])


def _subdivide(points: FloatArray, times: int) -> FloatArray:
    """Places on the straight lines between points (n, 2), ``times`` a line, and the last point."""
    if len(points) == 1:
        return points
    wanted = np.arange(times * (len(points) - 1) + 1) / times
    whole = np.arange(len(points))
    return np.column_stack([np.interp(wanted, whole, column) for column in points.T])


def _roofs(columns: Columns) -> FloatArray:
    """(nx, ny) the highest point about each column; over gaps that of what is nearest."""
    nearest = ndimage.distance_transform_edt(
        ~columns.filled, return_distances=False, return_indices=True
    )
    # Columns next to those that a line is sampled in count as well.
    return np.asarray(ndimage.maximum_filter(columns.highs[tuple(nearest)], 3, mode="nearest"))
