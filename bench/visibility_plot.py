"""Pictures of what view cells cost: time against one thing at a time, all axes logarithmic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from bench.machine import header
from bench.record import Row

_AXES = {
    "cells": "view cells",
    "objects": "objects of the city",
    "epsilon": "epsilon, m",
    "cell_size": "edge of a cell, m",
}


def plot_cells(path: Path, rows: Sequence[Row], command: str) -> None:
    """Write a PNG of rows that say what is ``varied``: seconds by cells, else ms a cell.

    Times are of the processor, all cores together.
    """
    figure = Figure(figsize=(16.0, 4.6), layout="constrained")
    columns = [column for column in _AXES if any(row["varied"] == column for row in rows)]
    for axes, column in zip(figure.subplots(1, len(columns)), columns, strict=True):
        mine = sorted(
            (row for row in rows if row["varied"] == column), key=lambda row: _number(row, column)
        )
        _plot(axes, mine, column)
    figure.supxlabel("\n".join(header(command)), fontsize=7, color="#555555")
    figure.savefig(path, dpi=100)


def _plot(axes: Axes, rows: Sequence[Row], column: str) -> None:
    whole = column == "cells"
    at = [_number(row, column) for row in rows]
    took = [_number(row, "processor_seconds" if whole else "processor_ms_a_cell") for row in rows]
    axes.plot(at, took, "o-", label="measured")
    if whole:
        scale = took[-1] / at[-1]
        axes.plot(at, [scale * count for count in at], "--", color="#888888", label="linear")
    axes.set(xscale="log", yscale="log", xlabel=_AXES[column])
    axes.set_ylabel("processor seconds, all cells" if whole else "processor milliseconds a cell")
    low, high = min(took), max(took)
    middle, reach = (low * high) ** 0.5, max((high / low) ** 0.5 * 1.3, 10.0**0.5)
    axes.set_ylim(middle / reach, middle * reach)
    axes.set_xticks(at, [f"{value:g}" for value in at])
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def _number(row: Row, column: str) -> float:
    return float(str(row[column]))
