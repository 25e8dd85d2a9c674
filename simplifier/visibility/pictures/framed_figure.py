"""A picture with words above it and a legend below."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from simplifier.geometry.mesh import FloatArray
from simplifier.report.png import figure_image, png_bytes

INK, SOFT, LINE = "#1b1b1a", "#6a6a66", "#b9b9b3"
PIXELS = 1080
"""Along the longer side of what is shown."""

DPI = 150
LETTERS = 9.5
HEAD, FOOT = 1.15, 1.15
"""Inches above and below what is shown."""


class FramedFigure:
    """A white sheet of ``width`` and ``height`` inches, with a title and lines at its top.

    Letters become smaller where words would not fit.
    """

    def __init__(self, width: float, height: float, *, title: str, lines: str) -> None:
        self.figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
        self._size = width, height
        self._write(title, 0.2, 14.0, color=INK, fontweight="bold")
        self._write(lines, 0.54, LETTERS, color=SOFT, linespacing=1.35)

    def _write(self, words: str, below: float, letters: float, **how: Any) -> None:
        """Words so many inches below the top."""
        width, height = self._size
        place = 0.2 / width, 1.0 - below / height
        text = self.figure.text(*place, words, fontsize=letters, va="top", **how)
        room = (width - 0.4) * DPI
        taken = text.get_window_extent().width
        if taken > room:
            text.set_fontsize(letters * room / taken)

    def add_axes(self, left: float, below: float, wide: float, tall: float) -> Any:
        """Axes at so many inches from the lower left corner."""
        width, height = self._size
        return self.figure.add_axes((left / width, below / height, wide / width, tall / height))

    def legend(self, entries: list[tuple[str, str]]) -> None:
        """Colours and their words at the bottom."""
        patches = [
            Patch(facecolor=colour, edgecolor=SOFT, linewidth=0.5, label=words)
            for colour, words in entries
        ]
        width, height = self._size
        self.figure.legend(
            handles=patches, loc="center left", bbox_to_anchor=(0.15 / width, 0.22 / height),
            ncols=len(patches), frameon=False, fontsize=LETTERS, labelcolor=INK,
            handlelength=1.3, columnspacing=1.3, handletextpad=0.5, borderaxespad=0.0,
        )  # fmt: skip

    def png(self) -> bytes:
        """The picture."""
        return png_bytes(figure_image(self.figure))


def rgb(colour: str) -> FloatArray:
    """(3,) 0 to 255 of a colour as "#rrggbb"."""
    return np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)], dtype=np.float64)
