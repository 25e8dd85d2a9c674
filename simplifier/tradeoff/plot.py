"""Time against recall as pictures: a panel for every mesh and budget.

Words beside the points of a plot, placed where they cover neither each other nor a point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator

from simplifier.geometry.mesh import FloatArray
from simplifier.report.png import figure_image, png_bytes
from simplifier.tradeoff.cases import Case, Judged
from simplifier.tradeoff.sweep import KNOBS, Knob, Setting
from simplifier.wording import percent, picture_line

_PANEL = (6.4, 4.4)  # inches
_LETTERS = 9.0  # typographic points
_MOST_NAMED = 24  # points of a panel, so that the dominated get their names too
_LEAST_SPAN = 0.04  # of the recall axis: noise is not blown up beyond a few points
_MARKS: dict[Knob | None, str] = {
    "preset": "D", "resolution": "s", "directions": "^", "time": "o", None: "P",
}  # fmt: skip


@dataclass(frozen=True)
class Theme:
    """Colours of a picture; ``knobs`` are told apart by their marks too."""

    page: str
    ink: str
    soft: str
    line: str
    front: str
    knobs: dict[Knob | None, str]


LIGHT = Theme(
    "#ffffff", "#1b1b1a", "#6a6a66", "#e4e4e0", "#c9a227",
    {"preset": "#1b1b1a", "resolution": "#c2410c", "directions": "#00795c", "time": "#1d5fc4",
     None: "#8a8a85"},
)  # fmt: skip
DARK = Theme(
    "#222221", "#f0f0ec", "#a5a59f", "#3a3a37", "#d9b544",
    {"preset": "#f0f0ec", "resolution": "#ff9a62", "directions": "#4fd1a5", "time": "#82b1ff",
     None: "#8f8f89"},
)  # fmt: skip


def case_picture(case: Case, theme: Theme) -> bytes:
    """PNG of one mesh at one budget, 1280 x 880 pixels; its title is left to the caption."""
    figure = Figure(figsize=_PANEL, dpi=200, facecolor=theme.page)
    axes = figure.add_axes((0.085, 0.115, 0.895, 0.83))
    _draw_case(axes, case, theme)
    return png_bytes(figure_image(figure))


def overview_picture(cases: Sequence[Case], precision: float, footer: str) -> bytes:
    """PNG of all cases: a row a mesh, a column a budget."""
    theme = LIGHT
    meshes = list(dict.fromkeys(case.mesh for case in cases))
    budgets = sorted({case.budget for case in cases})
    columns, rows = max(len(budgets), 1), max(len(meshes), 1)
    width, height = _PANEL[0] * max(columns, 2), (_PANEL[1] + 0.4) * rows + 1.3
    figure = Figure(figsize=(width, height), dpi=100, facecolor=theme.page)
    several = any(item.setting.knob is None for case in cases for item in case.judged)
    _head(figure, precision, several, height, theme)
    _foot(figure, footer if cases else "nothing was measured", height, theme)
    for case in cases:
        row, column = meshes.index(case.mesh), budgets.index(case.budget)
        panel = _panel(row, column, columns, height)
        axes = figure.add_axes(panel)
        title = f"{picture_line(case.mesh)}, budget {case.budget:,}"
        axes.set_title(title, loc="left", fontsize=11, weight="bold", color=theme.ink, pad=20.0)
        _draw_case(axes, case, theme)
    return png_bytes(figure_image(figure))


def _panel(row: int, column: int, columns: int, height: float) -> tuple[float, float, float, float]:
    """Left, bottom, width, height as shares of the figure."""
    each = 1.0 / columns
    inches = _PANEL[1] + 0.4
    bottom = height - 0.95 - (row + 1) * inches + 0.65
    return (column * each + 0.085 * each, bottom / height, 0.885 * each, (inches - 1.1) / height)


def _draw_case(axes: Any, case: Case, theme: Theme) -> None:
    axes.set_facecolor(theme.page)
    low, high = _recall_limits(case)
    fast, slow = _time_limits(case)
    axes.set(xscale="log", xlim=(fast, slow), ylim=(low, high))
    _finish(axes, theme)
    stairs = _stairs(case.front, slow, low)
    axes.fill_between(*stairs.T, low, color=theme.front, alpha=0.07, linewidth=0.0, zorder=1)
    axes.plot(*stairs.T, color=theme.front, linewidth=2.2, alpha=0.9, zorder=2)
    curves = [_curve(case, knob) for knob in KNOBS]
    for knob, curve in zip(KNOBS, curves, strict=True):
        axes.plot(*curve.T, color=theme.knobs[knob], linewidth=0.9, alpha=0.45, zorder=3)
    for item in case.measured:
        _draw_mark(axes, item, max(item.recall, low), theme, below=item.recall < low)
    points = np.array([[i.seconds, max(i.recall, low)] for i in case.measured]).reshape(-1, 2)
    place_labels(axes, _labels(case, low, theme), points, [stairs, *curves], _LETTERS)


def _recall_limits(case: Case) -> tuple[float, float]:
    """From a little below the front and the default; what is further down is drawn at the edge."""
    shown = [item.recall for item in case.front]
    if case.default is not None:
        shown.append(case.default.recall)
    shown = shown or [item.recall for item in case.measured] or [0.0, 1.0]
    top = max([*shown, *(item.recall for item in case.measured)])
    span = max(top - min(shown), _LEAST_SPAN)
    return max(min(shown) - 0.25 * span, -0.02), top + 0.12 * span


def _time_limits(case: Case) -> tuple[float, float]:
    times = [item.seconds for item in case.measured] or [0.1, 1.0]
    ratio = max(max(times) / min(times), 2.0)
    return min(times) / ratio**0.08, max(times) * ratio**0.14


def _stairs(front: Sequence[Judged], slow: float, low: float) -> FloatArray:
    """(n, 2) corners of the front: up at each of its points, then on to the right edge."""
    corners, height = [], low
    for item in front:
        corners += [(item.seconds, height), (item.seconds, item.recall)]
        height = item.recall
    corners += [(slow, height)] if corners else []
    return np.array(corners).reshape(-1, 2)


def _curve(case: Case, knob: Knob) -> FloatArray:
    """(n, 2) points of the settings of one knob and the default, fastest first."""
    points = [i for i in case.measured if i.setting.knob == knob or i is case.default]
    points.sort(key=lambda item: item.seconds)
    return np.array([[item.seconds, item.recall] for item in points]).reshape(-1, 2)


def _draw_mark(axes: Any, item: Judged, at: float, theme: Theme, *, below: bool) -> None:
    colour = theme.knobs[item.setting.knob]
    shape = "v" if below else _MARKS[item.setting.knob]
    fill = colour if item.verdict == "front" else theme.page
    style = {"marker": shape, "markersize": 7.0, "markeredgewidth": 1.5, "clip_on": False}
    axes.plot(item.seconds, at, mec=colour, mfc=fill, zorder=5, **style)
    if item.verdict == "imprecise":
        axes.plot(item.seconds, at, marker="x", markersize=11.0, mec=colour, zorder=5)


def _labels(case: Case, low: float, theme: Theme) -> list[PointLabel]:
    """The default first, then the front, then the others as far as there is room."""
    front, default = case.front, case.default
    first = [default] if default is not None else []
    rest = [item for item in case.measured if item not in front and item is not default]
    labels = []
    for item in [*first, *(item for item in front if item is not default), *rest]:
        named = item in front or item is default
        if not named and len(case.measured) > _MOST_NAMED:
            continue
        text = _short(item.setting)
        if item.recall < low:
            text = f"{text}: {percent(item.recall)}"
        colour = theme.knobs[item.setting.knob] if named else theme.soft
        weight = "bold" if item is default else "normal"
        at = max(item.recall, low)
        labels.append(PointLabel(item.seconds, at, text, colour, weight, optional=not named))
    return labels


def _short(setting: Setting) -> str:
    """The name; of several knobs, which fill a picture, the values of all three alone."""
    if setting.knob is not None:
        return setting.name
    return f"{setting.resolution} / {setting.directions} / {setting.time:g}"


def _finish(axes: Any, theme: Theme) -> None:
    axes.set_xlabel("Time from mesh to occluder, seconds", color=theme.ink, fontsize=_LETTERS)
    axes.annotate(
        "Recall", (0.0, 1.0), (-30.0, 7.0), "axes fraction", "offset points", color=theme.ink,
        fontsize=_LETTERS,
    )  # fmt: skip
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:.4g} %"))
    axes.minorticks_off()
    axes.tick_params(colors=theme.soft, labelsize=_LETTERS, length=3.0)
    axes.grid(color=theme.line, linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(theme.soft)


def _head(figure: Figure, precision: float, several: bool, height: float, theme: Theme) -> None:
    title = f"Speed against accuracy, settings of at least {100.0 * precision:.6g} % precision"
    figure.text(0.02, 1.0 - 0.3 / height, title, fontsize=14, fontweight="bold", color=theme.ink)
    style: dict[str, Any] = {"linestyle": "", "markersize": 7.0, "markeredgewidth": 1.5}
    keys = [
        Line2D([], [], color=theme.knobs[knob], marker=_MARKS[knob], label=knob, **style)
        for knob in KNOBS
    ]
    if several:
        label = "resolution / directions / time"
        keys.append(
            Line2D([], [], color=theme.knobs[None], marker=_MARKS[None], label=label, **style)
        )
    keys.append(Line2D([], [], color=theme.front, linewidth=2.2, label="Pareto front (filled)"))
    hollow = {**style, "mec": theme.soft, "mfc": theme.page}
    keys.append(Line2D([], [], marker="o", label="dominated", **hollow))
    keys.append(Line2D([], [], marker="x", mec=theme.soft, label="too imprecise", linestyle=""))
    keys.append(Line2D([], [], marker="v", label="far below", **hollow))
    figure.legend(
        handles=keys, loc="upper left", bbox_to_anchor=(0.013, 1.0 - 0.38 / height),
        ncols=len(keys), frameon=False, fontsize=10, handletextpad=0.3, columnspacing=1.4,
        labelcolor=theme.ink,
    )  # fmt: skip


def _foot(figure: Figure, text: str, height: float, theme: Theme) -> None:
    figure.text(0.02, 0.1 / height, text, fontsize=8, color=theme.soft)


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
class PointLabel:
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
    labels: Sequence[PointLabel],
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


def _extent(axes: Any, label: PointLabel, size: float) -> FloatArray:
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


def _write(axes: Any, label: PointLabel, box: FloatArray, size: float, *, leader: bool) -> None:
    middle = ((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0)
    line = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, "shrinkB": 4.0}
    axes.annotate(
        label.text, (label.x, label.y), middle, textcoords="figure pixels", ha="center",
        va="center", color=label.colour, fontsize=size, fontweight=label.weight,
        annotation_clip=False, zorder=6, arrowprops=line if leader else None,
    )  # fmt: skip
