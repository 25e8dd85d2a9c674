"""A flythrough frame by frame: recall, wrong pixels, and what the occluders cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from simplifier.culling.drawn import Way
from simplifier.culling.flythrough import Flythrough
from simplifier.culling.flythrough_rows import CULLED_BY, drawn_share, pixel_words, recall_words
from simplifier.culling.frame import FrameFigures
from simplifier.report.png import figure_image, png_bytes
from simplifier.wording import count, percent, picture_line, small_percent

_INK, _SOFT, _LINE = "#1b1b1a", "#6a6a66", "#e4e4e0"
_PARTS, _OBJECTS, _WRONG, _COST = "#1d5fc4", "#c77b0a", "#c80028", "#00795c"
_WAYS = {
    Way.FRUSTUM: "#8a8a86",
    Way.PVS: "#7a3fb0",
    Way.OCCLUDERS: _COST,
    Way.BOTH: "#c77b0a",
}
_SIZE = (10.0, 10.9)  # inches
_LETTERS = 9.5
_PANELS = ((1.26, 1.638), (3.864, 1.386), (6.216, 1.554), (8.716, 1.554))  # from above, and height
_LEFT, _WIDTH = 0.085, 0.89
_LEAST_WRONG = 1e-4  # of the axis: a hole of one pixel is not blown up to a mountain


def flythrough_plot(flown: Flythrough, scene_name: str) -> bytes:
    """PNG of four panels, one over the other, with the sums in their titles; 1500 pixels wide."""
    figure = Figure(figsize=_SIZE, dpi=150, facecolor="white")
    frames = f"{len(flown.frames):,} frames of path '{picture_line(flown.path.name)}'"
    title = f"{picture_line(scene_name)}: what its occluders hide, {frames}"
    figure.text(0.02, 1.0 - 0.378 / _SIZE[1], title, fontsize=14, fontweight="bold", color=_INK)
    axes = [figure.add_axes(_place(*panel)) for panel in _PANELS]
    _draw_recall(axes[0], flown)
    _draw_wrong(axes[1], flown)
    _draw_cost(axes[2], flown)
    _draw_drawn(axes[3], flown)
    for one in axes:
        _finish(one, flown)
    axes[-1].set_xlabel("Frame", color=_INK, fontsize=_LETTERS)
    return png_bytes(figure_image(figure))


def _place(top: float, height: float) -> tuple[float, float, float, float]:
    """Of a panel, by inches from above."""
    return _LEFT, 1.0 - (top + height) / _SIZE[1], _WIDTH, height / _SIZE[1]


def _draw_recall(axes: Any, flown: Flythrough) -> None:
    whole = flown.total
    # Wide below and thin above: where every object is one part, both are seen.
    _line(axes, flown, lambda f: f.objects.recall, _OBJECTS, "objects", width=4.0)
    _line(axes, flown, lambda f: f.parts.recall, _PARTS, "parts", width=1.6)
    words = f"parts: {recall_words(whole.parts)}; objects: {recall_words(whole.objects)}"
    _title(axes, "Recall", words)
    axes.set_ylim(-0.02, 1.04)
    _legend(axes)


def _draw_wrong(axes: Any, flown: Flythrough) -> None:
    _line(axes, flown, lambda f: f.wrong_share, _WRONG, "wrong", width=1.6)
    whole = flown.total
    culled = count(whole.parts.wrong, "part")
    words = f"{pixel_words(whole)}, by {culled} culled although visible"
    _title(axes, "Wrong pixels", words)
    most = flown.worst_picture.figures.wrong_share
    axes.set_ylim(0.0, max(1.15 * most, _LEAST_WRONG))


def _draw_cost(axes: Any, flown: Flythrough) -> None:
    _line(axes, flown, lambda f: f.triangle_share or None, _COST, "triangles", width=1.6)
    whole, count = flown.total, len(flown.frames)
    drawn_each, there = whole.occluder_triangles / count, whole.scene_triangles // count
    words = f"{drawn_each:,.0f} a frame for {there:,}: {small_percent(whole.triangle_share)}"
    _title(axes, "Occluder triangles drawn, of the scene's", words)
    shares = [f.figures.triangle_share for f in flown.frames if f.figures.occluder_triangles]
    _by_powers(axes, shares)


def _draw_drawn(axes: Any, flown: Flythrough) -> None:
    whole, shares = flown.total, []
    for way in whole.drawn:

        def share(figures: FrameFigures, way: Way = way) -> float | None:
            return figures.drawn[way].triangles / figures.scene_triangles or None

        _line(axes, flown, share, _WAYS[way], CULLED_BY[way], width=1.6)
        shares += [one for frame in flown.frames if (one := share(frame.figures)) is not None]
    words = [
        f"{CULLED_BY[way]}: {percent(part)}"
        for way in whole.drawn
        if way != Way.FRUSTUM and (part := drawn_share(whole, way)) is not None
    ]
    told = "; ".join(words)
    _title(axes, "Triangles drawn, of the scene's", f"of those in the frustum, {told}" * bool(told))
    _legend(axes, lift=0.14)  # above the words
    _by_powers(axes, shares)


def _legend(axes: Any, lift: float = 0.0) -> None:
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0 + lift), ncols=4, frameon=False,
        fontsize=_LETTERS, labelcolor=_INK, borderaxespad=0.2,
    )  # fmt: skip


def _by_powers(axes: Any, shares: Sequence[float]) -> None:
    low, high = min(shares, default=0.01), max(shares, default=0.01)
    axes.set(yscale="log", ylim=(low / 3.0, high * 3.0))


def _line(
    axes: Any,
    flown: Flythrough,
    value: Callable[[FrameFigures], float | None],
    colour: str,
    label: str,
    *,
    width: float,
) -> None:
    """A value of each frame; what is None leaves a gap."""
    values = [value(frame.figures) for frame in flown.frames]
    heights = [float("nan") if one is None else one for one in values]
    places = [frame.index for frame in flown.frames]
    axes.plot(
        places, heights, color=colour, linewidth=width, marker="o", markersize=width + 1.6,
        label=label, clip_on=False, zorder=3,
    )  # fmt: skip


def _title(axes: Any, what: str, words: str) -> None:
    """The panel's name in bold, and its sums below."""
    common = {"xycoords": "axes fraction", "textcoords": "offset points", "color": _INK}
    axes.annotate(what, (0.0, 1.0), (0.0, 25.0), fontsize=11, fontweight="bold", **common)
    axes.annotate(words, (0.0, 1.0), (0.0, 9.0), fontsize=_LETTERS, **common)


def _finish(axes: Any, flown: Flythrough) -> None:
    axes.set_xlim(-0.5, max(len(flown.path.cameras), 2) - 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=12))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _tick(value)))
    axes.minorticks_off()
    axes.tick_params(colors=_SOFT, labelsize=_LETTERS, length=3.0)
    axes.grid(color=_LINE, linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(_SOFT)


def _tick(value: float) -> str:
    return f"{round(100.0 * value, 9):.12g} %"
