"""Pictures of convergence: errors with bars, logarithmic axes, half a point as a line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from bench.machine import header
from bench.stability.convergence.curve import Curve
from bench.stability.convergence.making import FIGURES, Trial
from bench.stability.convergence.spread import HALF_A_POINT

_COLOURS = ("#1d5fc4", "#c2410c", "#00795c", "#7c3aed", "#8a6d00")
_MARKS = ("o", "s", "^", "D", "v")
_SOFT = "#6a6a66"
_LEAST = 3e-4  # points: below that an error is drawn at the edge


def plot_errors(path: Path, curves: Sequence[Curve], title: str, command: str) -> None:
    """Write a PNG: a column a knob, a row a figure; the typical error and how sure it is."""
    several = [curve for curve in curves if len(curve.errors) > 1]
    knobs = list(dict.fromkeys(curve.knob for curve in several))
    figures = list(dict.fromkeys(curve.figure for curve in several))
    picture, grid = _begun(len(figures), len(knobs), title, command)
    for row, figure in enumerate(figures):
        for column, knob in enumerate(knobs):
            mine = [one for one in several if (one.knob, one.figure) == (knob, figure)]
            _draw_errors(grid[row][column], mine)
            grid[row][column].set_title(f"{figure}, against {knob}", fontsize=10, loc="left")
            grid[row][column].set_ylabel("typical error, points", fontsize=9)
    _end(picture, grid[0][0], path)


def plot_trials(path: Path, trials: Sequence[Trial], title: str, command: str) -> None:
    """Write a PNG: a column a knob, a row a figure; what changes against the default."""
    knobs = list({trial.knob.name: trial.knob for trial in trials}.values())
    meshes = list(dict.fromkeys(trial.mesh for trial in trials))
    picture, grid = _begun(len(FIGURES), len(knobs), title, command)
    for row, figure in enumerate(FIGURES):
        for column, knob in enumerate(knobs):
            axes = grid[row][column]
            for index, mesh in enumerate(meshes):
                mine = [t for t in trials if (t.mesh, t.knob.name) == (mesh, knob.name)]
                _draw_trials(axes, mine, figure, index, mesh)
            axes.axhspan(-HALF_A_POINT, HALF_A_POINT, color="#1b1b1a", alpha=0.07, linewidth=0)
            _finish(axes, knob.values, knob.default)
            axes.set_title(f"{figure}, against {knob.name}", fontsize=10, loc="left")
            axes.set_ylabel("points above the default", fontsize=9)
    _end(picture, grid[0][0], path)


def _begun(rows: int, columns: int, title: str, command: str) -> tuple[Figure, Any]:
    picture = Figure(figsize=(4.3 * columns, 3.4 * rows + 1.3), layout="constrained", dpi=110)
    picture.suptitle(title, fontsize=12, fontweight="bold", x=0.01, ha="left")
    picture.supxlabel("; ".join(header(command)[:2]), fontsize=7, color=_SOFT)
    return picture, picture.subplots(rows, columns, squeeze=False)


def _draw_errors(axes: Axes, curves: Sequence[Curve]) -> None:
    for index, curve in enumerate(curves):
        errors = [curve.errors[value] for value in curve.values]
        typical = np.maximum([error.typical for error in errors], _LEAST)
        # The scatter of a scatter: one part in the square root of twice the seeds.
        bars = typical / np.sqrt([2.0 * (error.count - 1) for error in errors])
        axes.errorbar(curve.values, typical, bars, label=curve.mesh, **_style(index))
    axes.axhline(HALF_A_POINT, color=_SOFT, linestyle="--", linewidth=1.0)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    _finish(axes, curves[0].values, curves[0].default)


def _draw_trials(axes: Axes, trials: Sequence[Trial], figure: str, index: int, mesh: str) -> None:
    usual = next(trial for trial in trials if trial.value == trial.knob.default)
    gains = [trial.spread(figure).mean - usual.spread(figure).mean for trial in trials]
    bars = [trial.spread(figure).standard_error for trial in trials]
    axes.errorbar([trial.value for trial in trials], gains, bars, label=mesh, **_style(index))


def _style(index: int) -> dict[str, Any]:
    return {
        "color": _COLOURS[index % len(_COLOURS)], "marker": _MARKS[index % len(_MARKS)],
        "markersize": 4.5, "linewidth": 1.2, "capsize": 2.5, "elinewidth": 1.0,
    }  # fmt: skip


def _finish(axes: Axes, values: Sequence[int], default: int) -> None:
    axes.axvline(default, color=_SOFT, linewidth=0.8, alpha=0.6)
    axes.set_xscale("log", base=2)
    axes.set_xticks(list(values), [f"{value:,}" for value in values])
    axes.minorticks_off()
    axes.tick_params(labelsize=8, colors=_SOFT)
    axes.grid(alpha=0.25)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _end(picture: Figure, first: Axes, path: Path) -> None:
    handles, labels = first.get_legend_handles_labels()
    picture.legend(
        handles, labels, loc="outside upper right", ncols=len(labels), frameon=False, fontsize=9
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.savefig(path)
