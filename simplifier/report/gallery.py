"""All pictures of one occluder.

How precision and recall spread over the views, as in the paper's figure 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.report.png import figure_image, png_bytes
from simplifier.report.silhouettes import (
    BLACK,
    BLUE,
    YELLOW,
    ViewPicture,
    silhouette_sheet,
    view_pictures,
)
from simplifier.wording import percent

COLOURS = {"yellow": YELLOW, "black": BLACK, "blue": BLUE}
"""Of the silhouettes, (red, green, blue) from 0 to 255."""


@dataclass(frozen=True, eq=False)
class Gallery:
    """PNG bytes, and the views that they were made from.

    ``views``, ``view_files``  silhouettes, the worst recall first.
    ``sheet``  all of them in one picture with captions.
    ``recall``, ``precision``  histograms over all views.
    """

    views: list[ViewPicture]
    view_files: list[bytes]
    sheet: bytes
    recall: bytes
    precision: bytes


def draw_gallery(
    mesh: TriangleMesh, occluder: Occluder, accuracy: AccuracyReport, device: Device = PROCESSOR
) -> Gallery:
    """Draw everything; about a second.  Raises as :func:`~.accuracy.view_masks`."""
    views = view_pictures(mesh, occluder, accuracy, device=device)
    count = len(occluder.faces)
    title = (
        f"{count:,} {'triangle' if count == 1 else 'triangles'}, "
        f"recall {percent(accuracy.recall, 2)}, precision {percent(accuracy.precision, 2)}"
    )
    return Gallery(
        views,
        [png_bytes(view.image) for view in views],
        silhouette_sheet(views, title),
        recall_histogram(accuracy.recall_by_view),
        precision_histogram(accuracy.precision_by_view),
    )


_BINS = 25
_WIDEST_ZOOM = 1e-3  # of the precision axis: noise is not blown up beyond a tenth of a percent


def recall_histogram(recall: FloatArray) -> bytes:
    """PNG of (V,) recalls: 25 bins over 0 to 1, median and worst marked."""
    return _histogram("Recall", recall, 0.0, digits=1)


def precision_histogram(precision: FloatArray) -> bytes:
    """PNG of (V,) precisions: 25 bins from just below the worst to 1; the axis label says so."""
    return _histogram("Precision", precision, zoomed_axis_start(float(precision.min())), digits=2)


def zoomed_axis_start(worst: float) -> float:
    """Start of an axis that ends at 1 and holds all: 1, 2 or 5 times a power of ten wide."""
    width = max(1.0 - worst, _WIDEST_ZOOM)
    power = 10.0 ** math.floor(math.log10(width))
    # The slack keeps 0.1, which floating point makes 0.09999999999999998, in its own decade.
    steps = [step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= width * (1.0 - 1e-9)]
    return min(max(0.0, 1.0 - steps[0]), worst)


def _histogram(name: str, values: FloatArray, low: float, digits: int) -> bytes:
    figure = Figure(figsize=(7.2, 3.6), dpi=100, facecolor="white")
    axes = figure.add_axes((0.09, 0.16, 0.85, 0.68))  # right of it, half of "100.000 %" has room
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
    return png_bytes(figure_image(figure))
