"""What all pictures of view cells share: a plan with its coordinates, words and a scale."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from simplifier.geometry.mesh import FloatArray
from simplifier.report.png import RgbImage
from simplifier.visibility.pictures.framed_figure import (
    DPI,
    FOOT,
    HEAD,
    INK,
    LETTERS,
    LINE,
    PIXELS,
    SOFT,
    FramedFigure,
)

STREET = "#f6f6f3"

_LEFT, _RIGHT = 0.75, 0.3  # inches beside the plan
_BAR = 1.15  # inches for a scale of colours at the right
_LEAST = 4.6  # inches: the words above need as much
_RING = 0.035  # of the longer side: a cell that is smaller gets a ring


class PlanFigure(FramedFigure):
    """A picture of the plan from ``low`` to ``high`` (2,), upright, with words above it.

    ``origin``  (3,) what is added for coordinates of the world; ``axes`` their two letters.
    """

    def __init__(
        self,
        low: FloatArray,
        high: FloatArray,
        *,
        origin: FloatArray,
        letters: str,
        title: str,
        lines: str,
        bar: bool = False,
    ) -> None:
        extent = high - low
        wide, tall = extent / extent.max() * PIXELS / DPI
        right = _RIGHT + (_BAR if bar else 0.0)
        width = max(_LEFT + wide + right, _LEFT + _LEAST + right)
        super().__init__(width, HEAD + tall + FOOT, title=title, lines=lines)
        self.low, self.high = low, high
        left = _LEFT + 0.5 * (width - _LEFT - right - wide)
        self.axes: Any = self.add_axes(left, FOOT, wide, tall)
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), facecolor=STREET)
        self._place = (left, wide, tall)
        self._draw_coordinates(origin, letters)
        self._draw_scale(float(extent[0]))

    def _draw_coordinates(self, origin: FloatArray, letters: str) -> None:
        for axis, (limits, ticks) in enumerate(
            (
                (self.axes.get_xlim(), self.axes.set_xticks),
                (self.axes.get_ylim(), self.axes.set_yticks),
            )
        ):
            inches = self._place[1 + axis]
            locator = MaxNLocator(nbins=max(int(inches / 0.9), 2), steps=[1, 2, 5, 10])
            values = locator.tick_values(limits[0] + origin[axis], limits[1] + origin[axis])
            places = np.asarray(values) - origin[axis]
            inside = (places >= limits[0]) & (places <= limits[1])
            ticks(places[inside], [f"{value:.10g}" for value in np.asarray(values)[inside]])
        self.axes.tick_params(colors=SOFT, labelsize=8.5, length=3.0)
        for spine in self.axes.spines.values():
            spine.set_color(LINE)
        width, height = self._size
        left, wide, tall = self._place
        self.figure.text(
            (left + 0.4 * wide) / width, (FOOT - 0.45) / height, letters[0], ha="center",
            color=SOFT, fontsize=LETTERS, fontweight="bold",
        )  # fmt: skip
        self.figure.text(
            left / width, (FOOT + tall + 0.05) / height, letters[1], color=SOFT,
            fontsize=LETTERS, fontweight="bold",
        )  # fmt: skip

    def _draw_scale(self, extent: float) -> None:
        """A bar of a round length, at the lower right."""
        width, height = self._size
        left, wide, _ = self._place
        length = round_length(0.2 * extent)
        end = (left + wide) / width
        begin = end - length / extent * wide / width
        y = 0.55 / height
        self.figure.add_artist(_line([begin, end], [y, y], 2.2))
        for x in (begin, end):
            self.figure.add_artist(_line([x, x], [y - 0.05 / height, y + 0.05 / height], 1.2))
        words = f"{length:g} unit{'' if length == 1 else 's'}"
        self.figure.text(
            0.5 * (begin + end), y + 0.07 / height, words, ha="center", fontsize=LETTERS, color=INK
        )

    def show(self, image: RgbImage) -> None:
        """A picture of all of the plan, its first row at the top."""
        (x0, y0), (x1, y1) = self.low, self.high
        self.axes.imshow(image, extent=(x0, x1, y0, y1), interpolation="antialiased", zorder=1)
        self.axes.set_aspect("auto")

    def show_lines(self, image: RgbImage) -> None:
        """Thin dark lines over all else of the plan, where a picture is bright."""
        clear = np.zeros((*image.shape[:2], 4))
        clear[..., 3] = 0.5 / 255.0 * image[..., 0]
        (x0, y0), (x1, y1) = self.low, self.high
        self.axes.imshow(clear, extent=(x0, x1, y0, y1), interpolation="antialiased", zorder=4)
        self.axes.set_aspect("auto")

    def draw_cell(self, outline: FloatArray, colour: str) -> None:
        """A cell's plan, and a ring around it where it would hardly be seen."""
        self.axes.add_collection(
            PolyCollection(
                [outline], facecolors=colour, edgecolors="white", linewidths=0.8, zorder=4
            )
        )
        low, high = outline.min(axis=0), outline.max(axis=0)
        longest = float((self.high - self.low).max())
        if float((high - low).max()) < _RING * longest:
            x, y = 0.5 * (low + high)
            for shade, line in (("white", 4.0), (colour, 1.8)):
                self.axes.plot(
                    x, y, marker="o", markersize=21.0, fillstyle="none", color=shade,
                    markeredgewidth=line, zorder=5,
                )  # fmt: skip

    def colour_bar(self, mappable: Any, words: str, **more: Any) -> None:
        """A scale of colours to the right of the plan, its words above it."""
        width, height = self._size
        left, wide, tall = self._place
        begin = left + wide + 0.22
        axes: Any = self.add_axes(begin, FOOT, 0.18, 0.9 * tall)
        bar = self.figure.colorbar(mappable, cax=axes, **more)
        bar.outline.set_edgecolor(LINE)
        axes.tick_params(colors=SOFT, labelsize=8.5, length=3.0)
        self.figure.text(
            begin / width, (FOOT + 0.92 * tall) / height, words, fontsize=8.5, color=INK,
            linespacing=1.2,
        )  # fmt: skip


def _line(x: list[float], y: list[float], width: float) -> Any:
    return Line2D(x, y, color=INK, linewidth=width, solid_capstyle="butt")


def round_length(about: float) -> float:
    """1, 2 or 5 times a power of ten, no more than ``about``."""
    power = 10.0 ** math.floor(math.log10(about))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= about * (1.0 + 1e-9))
