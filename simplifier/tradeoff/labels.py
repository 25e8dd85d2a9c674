"""Words beside the points of a plot, placed where they cover neither each other nor a point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from simplifier.geometry.mesh import FloatArray

_DIRECTIONS = 16
_DISTANCES = (7.0, 12.0, 18.0, 26.0, 36.0, 48.0)  # from the point, in typographic points
_MARK = 3.5  # reach of a point, typographic points
_LEADER = 15.0  # a label further away gets a line to its point
_POINT, _OTHER, _LINE = 100.0, 400.0, 4.0  # costs of covering a point, a label, a piece of a line
_BEYOND = 100.0  # cost of a pixel outside of the axes
_FAR = 0.25  # cost of each typographic point of distance
_MOST = 50.0  # cost of an optional label: some of a line may be covered, a point may not
_MARGIN = 1.5  # kept free around a label, pixels


@dataclass(frozen=True)
class Label:
    """Words for a point: ``x``, ``y`` in data coordinates; with ``optional`` it is left out where
    there is no room."""

    x: float
    y: float
    text: str
    colour: str
    weight: str = "normal"
    optional: bool = False


def place_labels(
    axes: Any,
    labels: Sequence[Label],
    points: FloatArray,
    lines: Sequence[FloatArray],
    size: float,
) -> None:
    """Write the labels, the first ones first, each at the place that covers least.

    ``points`` (n, 2) and ``lines`` of (m, 2) corners, data coordinates, are what is not to be
    covered, lines less strictly than points.  ``size`` of the letters, typographic points.  The
    place of the axes in the figure and their limits must be final.
    """
    scale = axes.figure.dpi / 72.0
    frame = np.array(axes.get_window_extent().extents)
    marks = _around(axes.transData.transform(points), _MARK * scale)
    paths = [_along(axes.transData.transform(line)) for line in lines if len(line)]
    steps = _around(np.concatenate([np.empty((0, 2)), *paths]), 1.0)
    taken = np.empty((0, 4))
    for label in labels:
        at = axes.transData.transform((label.x, label.y))
        boxes = _places(at, _extent(axes, label, size), scale)
        cost = _outside(boxes, frame) * _BEYOND
        for others, each in ((marks, _POINT), (taken, _OTHER), (steps, _LINE)):
            cost += each * _meetings(boxes, others)
        best = int(np.argmin(cost + _FAR * np.repeat(_DISTANCES, _DIRECTIONS)))
        if label.optional and cost[best] > _MOST:
            continue
        taken = np.concatenate([taken, boxes[best : best + 1]])
        _write(axes, label, boxes[best], size, leader=_DISTANCES[best // _DIRECTIONS] > _LEADER)


def _extent(axes: Any, label: Label, size: float) -> FloatArray:
    """Width and height in pixels."""
    text = axes.text(0.0, 0.0, label.text, fontsize=size, fontweight=label.weight)
    extent = text.get_window_extent()
    text.remove()
    return np.array([extent.width, extent.height]) + 2.0 * _MARGIN


def _places(at: FloatArray, extent: FloatArray, scale: float) -> FloatArray:
    """(n, 4) boxes all around a point, the near ones first; left, bottom, right, top in pixels."""
    turns = 2.0 * math.pi * np.arange(_DIRECTIONS) / _DIRECTIONS - 0.25 * math.pi
    along = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    # The box touches the circle with the side or corner that faces the point.
    corner = 0.5 * extent * (np.clip(1.6 * along, -1.0, 1.0) - 1.0)
    reach = scale * np.array(_DISTANCES)[:, None, None]
    low = (at + reach * along + corner).reshape(-1, 2)
    return np.concatenate([low, low + extent], axis=1)


def _outside(boxes: FloatArray, frame: FloatArray) -> FloatArray:
    """(n,) pixels by which each box reaches over the frame's sides."""
    over = np.concatenate([frame[:2] - boxes[:, :2], boxes[:, 2:] - frame[2:]], axis=1)
    return np.asarray(np.maximum(over, 0.0).sum(axis=1))


def _meetings(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """(n,) how many of the others each box overlaps."""
    apart = (boxes[:, None, :2] >= others[:, 2:]) | (others[:, :2] >= boxes[:, None, 2:])
    return np.asarray((~apart.any(axis=2)).sum(axis=1), dtype=np.float64)


def _around(points: FloatArray, reach: float) -> FloatArray:
    return np.concatenate([points - reach, points + reach], axis=1)


def _along(path: FloatArray) -> FloatArray:
    """Points every few pixels along a line of corners; what is far out of sight is cut short."""
    pieces = [np.empty((0, 2))]
    for begin, end in pairwise(np.clip(path, -1e4, 1e4)):
        count = 2 + int(np.hypot(*(end - begin)) / 6.0)
        pieces.append(np.linspace(begin, end, count))
    return np.concatenate(pieces)


def _write(axes: Any, label: Label, box: FloatArray, size: float, *, leader: bool) -> None:
    middle = ((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0)
    line = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, "shrinkB": 4.0}
    axes.annotate(
        label.text, (label.x, label.y), middle, textcoords="figure pixels", ha="center",
        va="center", color=label.colour, fontsize=size, fontweight=label.weight,
        annotation_clip=False, zorder=6, arrowprops=line if leader else None,
    )  # fmt: skip
