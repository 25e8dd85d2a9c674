"""Pictures of convergence, drawn from the tables: error bars, the default, half a point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from bench.stability.convergence.spread import HALF_A_POINT, Spread

_STYLES = {
    "castle": ("#1d5fc4", "o"), "bunny_4968": ("#c2410c", "s"), "terrain": ("#00795c", "^"),
    "machine": ("#7c3aed", "D"),
}  # fmt: skip
_OTHER = ("#1b1b1a", "v")
_SOFT = "#6a6a66"
_STRAIGHT = 1.0  # points either side of 0 where the axis of gains is linear; further, logarithmic
_GAINS = (-100, -30, -10, -3, -1, -0.5, 0, 0.5, 1, 3, 10)

Cells = Mapping[str, str]
"""A row of a table that was read: all text."""


def plot_errors(
    path: Path, rows: Sequence[Cells], defaults: Mapping[str, int], title: str, footer: str
) -> None:
    """Write a PNG: a column a knob of ``defaults``, a row a figure; typical errors."""
    figures = _distinct(rows, "figure")
    picture, grid = _begun(len(figures), len(defaults), title, footer)
    for line, figure in zip(grid, figures, strict=True):
        for axes, (knob, default) in zip(line, defaults.items(), strict=True):
            mine = [row for row in rows if (row["figure"], row["knob"]) == (figure, knob)]
            for mesh in _distinct(mine, "mesh"):
                _draw_errors(axes, mesh, [row for row in mine if row["mesh"] == mesh])
            axes.axhline(HALF_A_POINT, color=_SOFT, linestyle="--", linewidth=1.0)
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.yaxis.set_minor_formatter(NullFormatter())
            _finish(axes, mine, default, f"{figure}, against {knob}")
        line[0].set_ylabel("typical error, points (dashed: half a point)", fontsize=9)
    _end(picture, grid[0][0], path)


def plot_gains(
    path: Path, rows: Sequence[Cells], defaults: Mapping[str, int], title: str, footer: str
) -> None:
    """Write a PNG: a column a knob, recall above precision; means less that of the default."""
    picture, grid = _begun(2, len(defaults), title, footer)
    for line, figure in zip(grid, ("recall", "precision"), strict=True):
        for axes, (knob, default) in zip(line, defaults.items(), strict=True):
            mine = [row for row in rows if row["knob"] == knob]
            for mesh in _distinct(mine, "mesh"):
                of_mesh = [row for row in mine if row["mesh"] == mesh]
                _draw_gains(axes, mesh, of_mesh, figure, default)
            axes.axhspan(-HALF_A_POINT, HALF_A_POINT, color="#1b1b1a", alpha=0.07, linewidth=0)
            axes.set_yscale("symlog", linthresh=_STRAIGHT)
            _finish(axes, mine, default, f"{figure}, against {knob}")
        low, high = line[0].get_ylim()  # one for the row
        ticks = [value for value in _GAINS if low <= value <= high]
        line[0].set_yticks(ticks, [f"{value:+g}" if value else "0" for value in ticks])
        line[0].set_ylabel("points above the default (grey: half a point)", fontsize=9)
    _end(picture, grid[0][0], path)


def _distinct(rows: Sequence[Cells], name: str) -> list[str]:
    return list(dict.fromkeys(row[name] for row in rows))


def _begun(rows: int, columns: int, title: str, footer: str) -> tuple[Figure, Any]:
    picture = Figure(figsize=(3.7 * columns, 3.4 * rows + 1.0), layout="constrained", dpi=110)
    picture.suptitle(title, fontsize=12, fontweight="bold", x=0.01, ha="left")
    picture.supxlabel(footer, fontsize=7, color=_SOFT)
    return picture, picture.subplots(rows, columns, squeeze=False, sharey="row")


def _draw_errors(axes: Axes, mesh: str, rows: Sequence[Cells]) -> None:
    errors = [
        Spread(float(row["offset"]), float(row["deviation"]), int(row["seeds"])) for row in rows
    ]
    typical = np.array([error.typical for error in errors])
    # The scatter of a scatter: one part in the square root of twice the seeds.
    bars = typical / np.sqrt([2.0 * (error.count - 1) for error in errors])
    _bars(axes, mesh, rows, np.where(typical > 0.0, typical, np.nan), bars)


def _draw_gains(axes: Axes, mesh: str, rows: Sequence[Cells], figure: str, default: int) -> None:
    means = np.array([float(row[figure]) for row in rows])
    usual = next(float(row[figure]) for row in rows if int(row["value"]) == default)
    bars = [float(row[f"{figure}_deviation"]) / int(row["seeds"]) ** 0.5 for row in rows]
    _bars(axes, mesh, rows, means - usual, bars)


def _bars(axes: Axes, mesh: str, rows: Sequence[Cells], at: Any, bars: Any) -> None:
    colour, mark = _STYLES.get(mesh, _OTHER)
    axes.errorbar(
        [int(row["value"]) for row in rows], at, bars, label=mesh, color=colour, marker=mark,
        markersize=4.5, linewidth=1.2, capsize=2.5, elinewidth=1.0,
    )  # fmt: skip


def _finish(axes: Axes, rows: Sequence[Cells], default: int, title: str) -> None:
    values = sorted({int(row["value"]) for row in rows})
    axes.axvline(default, color=_SOFT, linewidth=0.8, alpha=0.6)
    axes.set_xscale("log", base=2)
    axes.set_xticks(values, [_short(value) for value in values])
    axes.minorticks_off()
    axes.tick_params(labelsize=8, colors=_SOFT)
    axes.grid(alpha=0.25)
    axes.set_title(title, fontsize=10, loc="left")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _short(value: int) -> str:
    return f"{value // 1000}k" if value >= 1000 and value % 1000 == 0 else str(value)


def _end(picture: Figure, first: Axes, path: Path) -> None:
    handles, labels = first.get_legend_handles_labels()
    picture.legend(
        handles, labels, loc="outside upper right", ncols=len(labels), frameon=False, fontsize=9
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.savefig(path)
