"""Words beside the points of a plot, placed where they cover neither each other nor a point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np

from simplifier.geometry.mesh import FloatArray

_DIRECTIONS = 16
_DISTANCES = (7.0, 12.0, 18.0, 26.0, 36.0, 48.0)  # from the point, in typographic points
_LEADER = 15.0  # a label further away gets a line to its point
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


Box = tuple[float, float, float, float]
"""Left, bottom, right, top in pixels."""


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
    limits of the axes must be final.
    """
    figure = axes.figure
    figure.draw_without_rendering()
    scale = figure.dpi / 72.0
    edge = axes.get_window_extent()
    frame: Box = (edge.x0, edge.y0, edge.x1, edge.y1)
    marks = [_around(x, y, 5.0 * scale) for x, y in axes.transData.transform(points)]
    paths = [_along(axes.transData.transform(line)) for line in lines if len(line)]
    steps = [_around(x, y, 1.0) for path in paths for x, y in path]
    taken: list[Box] = []
    for label in labels:
        width, height = _extent(axes, label, size)
        x, y = axes.transData.transform((label.x, label.y))
        cost, distance, box = min(
            (_cost(box, marks, steps, taken, frame) + _FAR * distance, distance, box)
            for box, distance in _places(x, y, width, height, scale)
        )
        if label.optional and cost > _MOST:
            continue
        taken.append(box)
        _write(axes, label, box, size, leader=distance > _LEADER)


def _extent(axes: Any, label: Label, size: float) -> tuple[float, float]:
    text = axes.text(0.0, 0.0, label.text, fontsize=size, fontweight=label.weight)
    extent = text.get_window_extent()
    text.remove()
    return extent.width + 2.0 * _MARGIN, extent.height + 2.0 * _MARGIN


def _places(
    x: float, y: float, width: float, height: float, scale: float
) -> list[tuple[Box, float]]:
    """Boxes all around the point: the near ones first, and to the right and below first."""
    places = []
    for distance, index in product(_DISTANCES, range(_DIRECTIONS)):
        turn = -math.pi * 0.25 + 2.0 * math.pi * index / _DIRECTIONS
        u, v = math.cos(turn), math.sin(turn)
        # The box touches the circle with the side or corner that faces the point.
        left = x + distance * scale * u + 0.5 * width * (np.clip(1.6 * u, -1.0, 1.0) - 1.0)
        low = y + distance * scale * v + 0.5 * height * (np.clip(1.6 * v, -1.0, 1.0) - 1.0)
        box = (float(left), float(low), float(left + width), float(low + height))
        places.append((box, distance))
    return places


def _cost(
    box: Box, marks: Sequence[Box], steps: Sequence[Box], taken: Sequence[Box], frame: Box
) -> float:
    """What the box would cover; in the end the nearest of the free ones wins."""
    outside = sum(
        max(0.0, over)
        for over in (frame[0] - box[0], frame[1] - box[1], box[2] - frame[2], box[3] - frame[3])
    )
    return (
        100.0 * outside
        + sum(100.0 for other in marks if _meet(box, other))
        + sum(400.0 for other in taken if _meet(box, other))
        + sum(4.0 for other in steps if _meet(box, other))
    )


def _meet(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _around(x: float, y: float, reach: float) -> Box:
    return (x - reach, y - reach, x + reach, y + reach)


def _along(path: FloatArray) -> FloatArray:
    """Points every few pixels along a line of corners; what is far out of sight is cut short."""
    pieces = [np.empty((0, 2))]
    for begin, end in pairwise(np.clip(path, -1e4, 1e4)):
        count = 2 + int(np.hypot(*(end - begin)) / 6.0)
        pieces.append(np.linspace(begin, end, count))
    return np.concatenate(pieces)


def _write(axes: Any, label: Label, box: Box, size: float, *, leader: bool) -> None:
    middle = ((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0)
    line = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, "shrinkB": 4.0}
    axes.annotate(
        label.text, (label.x, label.y), middle, textcoords="figure pixels", ha="center",
        va="center", color=label.colour, fontsize=size, fontweight=label.weight,
        annotation_clip=False, zorder=6, arrowprops=line if leader else None,
    )  # fmt: skip
