"""Pictures of a growth: time, time by stage, and peak memory, all axes logarithmic."""

from __future__ import annotations

from collections.abc import Sequence
from math import log
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from bench.machine import header
from bench.record import Row

_TIMES = ("median_s", "min_s", "max_s")


def plot_growth(path: Path, rows: Sequence[Row], column: str, command: str) -> None:
    """Write a PNG; ``rows`` as :meth:`bench.growth.Growth.rows` gives them."""
    figure = Figure(figsize=(16.0, 5.2), layout="constrained")
    time, stage, memory = figure.subplots(1, 3)
    for mesh in dict.fromkeys(str(row["mesh"]) for row in rows):
        mine = [row for row in rows if row["mesh"] == mesh]
        _plot_mesh(time, memory, mesh, column, mine)
    first = [row for row in rows if row["mesh"] == rows[0]["mesh"]]
    for name in [name for name in first[0] if name.endswith("_s") and name not in _TIMES]:
        stage.plot(_column(first, column), _column(first, name), "o-", label=name[:-2])
    at = _column(first, column)
    _finish(time, at, column, "seconds", "Mesh in memory to occluder (median, min to max)")
    _finish(stage, at, column, "seconds", f"By stage, {first[0]['mesh']}")
    _finish(memory, at, column, "MiB", "Peak resident memory of the process")
    stage.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.supxlabel("\n".join(header(command)), fontsize=7, color="#555555")
    figure.savefig(path, dpi=110)


def plot_scene_growth(path: Path, rows: Sequence[Row], command: str) -> None:
    """Write a PNG of build time and memory against objects, beside n log n through the last."""
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    time, memory = figure.subplots(1, 2)
    at, took = _column(rows, "objects"), _column(rows, "first_s")
    scale = took[-1] / (at[-1] * log(at[-1]))
    time.plot(at, took, "o-", label="first build")
    time.plot(at, [scale * n * log(n) for n in at], "--", color="#888888", label="n log n")
    memory.plot(at, _column(rows, "peak_mib"), "o-", label="all processes, peak")
    _finish(time, at, "objects", "seconds", "A first build")
    _finish(memory, at, "objects", "MiB", "Its memory")
    figure.supxlabel("\n".join(header(command)), fontsize=7, color="#555555")
    figure.savefig(path, dpi=110)


def _plot_mesh(time: Axes, memory: Axes, mesh: str, column: str, rows: Sequence[Row]) -> None:
    at = _column(rows, column)
    middle, least, most = (_column(rows, name) for name in _TIMES)
    (line,) = time.plot(at, middle, "o-", label=mesh)
    time.fill_between(at, least, most, alpha=0.2, color=line.get_color())
    work, process = _column(rows, "work_mib"), _column(rows, "process_mib")
    memory.plot(at, work, "o-", label=f"{mesh}, while simplifying")
    if process != work:
        label = f"{mesh}, making the mesh included"
        memory.plot(at, process, "x--", color=line.get_color(), label=label)


def _finish(axes: Axes, at: Sequence[float], column: str, unit: str, title: str) -> None:
    """Logarithmic axes of at least a decade, so that noise does not look like growth."""
    axes.set(xscale="log", yscale="log", xlabel=_AXES[column], ylabel=unit, title=title)
    low, high = axes.get_ylim()
    if high < 10.0 * low:
        middle = (low * high) ** 0.5
        axes.set_ylim(middle / 10.0**0.5, middle * 10.0**0.5)
    axes.set_xticks(at, [_short(value) for value in at])
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def _short(value: float) -> str:
    if value >= 1e6:
        return f"{value / 1e6:g}M"
    return f"{value / 1e3:g}k" if value >= 1e3 else f"{value:g}"


_AXES = {
    "triangles": "triangles of the mesh",
    "resolution": "voxels along the longest edge",
    "budget": "budget, triangles",
    "objects": "objects of the scene",
}


def _column(rows: Sequence[Row], name: str) -> list[float]:
    return [float(str(row[name])) for row in rows]
