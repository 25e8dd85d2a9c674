"""How precision and recall spread over the views, as in the paper's figure 11."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from simplifier.geometry.mesh import FloatArray
from simplifier.report.png import drawn, encoded
from simplifier.wording import percent

_BINS = 25
_WIDEST_ZOOM = 1e-3  # of the precision axis: noise is not blown up beyond a tenth of a percent


def recall_histogram(recall: FloatArray) -> bytes:
    """PNG of (V,) recalls: 25 bins over 0 to 1, median and worst marked."""
    return _histogram("Recall", recall, 0.0, digits=1)


def precision_histogram(precision: FloatArray) -> bytes:
    """PNG of (V,) precisions: 25 bins from just below the worst to 1; the axis label says so."""
    return _histogram("Precision", precision, zoomed_from(float(precision.min())), digits=2)


def zoomed_from(worst: float) -> float:
    """Start of an axis that ends at 1 and holds all: 1, 2 or 5 times a power of ten wide."""
    width = max(1.0 - worst, _WIDEST_ZOOM)
    power = 10.0 ** math.floor(math.log10(width))
    # The slack keeps 0.1, which floating point makes 0.09999999999999998, in its own decade.
    steps = [step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= width * (1.0 - 1e-9)]
    return min(max(0.0, 1.0 - steps[0]), worst)


def _histogram(name: str, values: FloatArray, low: float, digits: int) -> bytes:
    figure = Figure(figsize=(7.2, 3.6), dpi=100, facecolor="white")
    axes = figure.add_axes((0.09, 0.16, 0.87, 0.68))
    axes.hist(values, bins=_BINS, range=(low, 1.0), color="#5b8def", edgecolor="white", zorder=2)
    marks = [("median", float(np.median(values)), "#111111", "--")]
    marks.append(("worst", float(values.min()), "#c0262d", "-"))
    for word, value, colour, style in marks:
        label = f"{word} {percent(value, digits)}"
        axes.axvline(
            value, color=colour, linestyle=style, linewidth=2.0, label=label, clip_on=False
        )
    span = 1.0 - low
    axes.set_xlim(low - 0.01 * span, 1.0 + 0.01 * span)
    title = f"{name} by view ({len(values)} {'view' if len(values) == 1 else 'views'})"
    axes.set_title(title, loc="left", fontweight="bold", fontsize=11, pad=12)
    zoom = f" (axis from {percent(low, digits)} to 100 %)" if low > 0.0 else ""
    axes.set_xlabel(f"{name} of a view{zoom}")
    axes.set_ylabel("Views")
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=6, integer=True, min_n_ticks=1))
    axes.grid(axis="y", color="#dddddd", zorder=0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
    return encoded(drawn(figure))
