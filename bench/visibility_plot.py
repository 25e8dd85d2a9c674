"""Pictures of what view cells cost, by one thing at a time, and of time against tightness."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from bench.machine import header
from bench.record import Row

_AXES = {
    "cells": "view cells",
    "objects": "objects of the city",
    "epsilon": "epsilon, m",
    "cell_size": "edge of a cell, m",
}
_COSTS = {
    "processor_ms_a_cell": "processor milliseconds a cell",
    "peak_mib": "peak memory of the process, MiB",
    "bytes_a_cell": "bytes of the file a cell",
}
_COLOURS = {
    "cull-map": "#0072b2", "strong": "#d55e00", "slice-wise": "#009e73",
    "voxel-column": "#cc79a7", "auto": "#1b1b1a",
}  # fmt: skip
_TICKS = (
    (1.6, (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)),
    (30.0, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)),
    (float("inf"), (1.0, 3.0)),
)
"""What is written along an axis of a decade, where its ends are no further apart than a ratio."""


def plot_cells(path: Path, rows: Sequence[Row], command: str) -> None:
    """Write a PNG of rows that say what is ``varied``: time, memory and bytes, axes logarithmic.

    Times are of the processor, all cores together: seconds by the number of cells, else a cell's.
    """
    figure = Figure(figsize=(16.0, 11.0), layout="constrained")
    columns = [column for column in _AXES if any(row["varied"] == column for row in rows)]
    grid = figure.subplots(len(_COSTS), len(columns), squeeze=False)
    for place, column in enumerate(columns):
        mine = sorted(
            (row for row in rows if row["varied"] == column), key=lambda row: _number(row, column)
        )
        for axes, cost in zip(grid[:, place], _COSTS, strict=True):
            _plot(axes, mine, column, cost)
    _save(figure, path, command)


def _plot(axes: Axes, rows: Sequence[Row], column: str, cost: str) -> None:
    whole = column == "cells" and cost == "processor_ms_a_cell"
    at = [_number(row, column) for row in rows]
    took = [_number(row, "processor_seconds" if whole else cost) for row in rows]
    axes.plot(at, took, "o-", label="measured")
    if whole:
        scale = took[-1] / at[-1]
        axes.plot(at, [scale * count for count in at], "--", color="#888888", label="linear")
        axes.legend(fontsize=8)
    axes.set(xscale="log", yscale="log", xlabel=_AXES[column])
    axes.set_ylabel("processor seconds, all cells" if whole else _COSTS[cost])
    low, high = min(took), max(took)
    middle, reach = (low * high) ** 0.5, max((high / low) ** 0.5 * 1.3, 10.0**0.5)
    axes.set_ylim(middle / reach, middle * reach)
    _finish(axes)
    axes.set_xticks(at, [f"{value:g}" for value in at])


def plot_front(path: Path, rows: Sequence[Row], command: str) -> None:
    """Write a PNG of time against tightness: axes a ``scene``, a line a ``method``.

    Of rows of one method the steps are joined in their order, and named by their ``step``.
    """
    scenes = list(dict.fromkeys(str(row["scene"]) for row in rows))
    figure = Figure(figsize=(5.6 * len(scenes), 5.2), layout="constrained")
    for axes, scene in zip(figure.subplots(1, len(scenes), squeeze=False)[0], scenes, strict=True):
        mine = [row for row in rows if row["scene"] == scene]
        for method in dict.fromkeys(str(row["method"]) for row in mine):
            steps = [row for row in mine if row["method"] == method]
            at = [_number(row, "processor_ms_a_cell") for row in steps]
            loose = [_number(row, "sets_to_seen") for row in steps]
            axes.plot(at, loose, "o-", color=_COLOURS[method], label=method)
            for row, x, y in zip(steps, at, loose, strict=True):
                axes.annotate(
                    str(row["step"]), (x, y), textcoords="offset points", xytext=(4, 4),
                    fontsize=7,
                )  # fmt: skip
        axes.set(xscale="log", yscale="log", title=scene)
        axes.margins(x=0.12)
        axes.set(xlabel="processor milliseconds a cell", ylabel="sets to what is seen")
        _finish(axes)
        axes.legend(fontsize=8)
    _save(figure, path, command)


def _finish(axes: Axes) -> None:
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        subs = next(some for most, some in _TICKS if high <= most * low)
        axis.set_major_locator(LogLocator(subs=subs))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3)


def _save(figure: Figure, path: Path, command: str) -> None:
    figure.supxlabel("\n".join(header(command)), fontsize=7, color="#555555")
    figure.savefig(path, dpi=100)


def _number(row: Row, column: str) -> float:
    return float(str(row[column]))
