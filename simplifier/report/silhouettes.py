"""Silhouettes of an original and its occluder over each other, coloured as in the paper's figure 7.

Black is what only the original covers (not hidden), yellow what both cover (hidden rightly), blue
what only the occluder covers (hidden wrongly), white neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from simplifier.accuracy.accuracy import AccuracyReport, view_masks
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.solid import BoolArray
from simplifier.report.png import RgbImage, figure_image, png_bytes
from simplifier.wording import percent, viewpoint

WHITE, BLACK, YELLOW, BLUE = (255, 255, 255), (20, 20, 20), (250, 200, 30), (30, 90, 220)
_PALETTE = np.array([WHITE, BLUE, BLACK, YELLOW], dtype=np.uint8)  # 2 * original + occluder

_MASK = 1024  # pixels a side that views are drawn at
_PICTURE = 640  # pixels a side after smoothing
_MARGIN = 0.03  # of the side, around the largest silhouette

# The contact sheet, pixels.
_COLUMNS, _CELL, _GAP, _CAPTION, _HEAD, _FOOT, _DPI = 3, 393, 20, 92, 60, 50, 100
_IN_PIXELS: dict[str, Any] = {"transform": IdentityTransform(), "fontweight": "bold"}


@dataclass(frozen=True, eq=False)
class ViewPicture:
    """One view as a picture.

    ``name``       "worst recall", "worst precision", both, or "view 17".
    ``index``      the view's place in the accuracy report.
    ``direction``  (3,) float64, the line of sight.
    ``viewpoint``  where the viewer stands, in words.
    ``precision``, ``recall``  of this view.
    ``image``      :data:`RgbImage`, square.
    """

    name: str
    index: int
    direction: NDArray[np.float64]
    viewpoint: str
    precision: float
    recall: float
    image: RgbImage


def silhouette(original: BoolArray, occluder: BoolArray) -> RgbImage:
    """Colour two masks (rows, columns), row 0 at the bottom, column 0 at u's low end.

    The picture has v up.  It is mirrored, because who looks along the direction sees u to the left.
    """
    codes = 2 * original.astype(np.uint8) + occluder.astype(np.uint8)
    return _PALETTE.take(codes[::-1, ::-1], axis=0)


def choose_views(accuracy: AccuracyReport, count: int = 6) -> list[int]:
    """Places of the view of worst recall, that of worst precision, and others well apart.

    Each further one is the view farthest from those chosen, opposite directions counting as the
    same (their silhouettes are mirror images); the first of equals.  Fewer where there are fewer.
    """
    chosen = list(dict.fromkeys([accuracy.worst_view, accuracy.worst_precision_view]))[:count]
    nearness = np.abs(accuracy.directions @ accuracy.directions[chosen].T).max(axis=1)
    while len(chosen) < min(count, len(accuracy.directions)):
        nearness[chosen] = np.inf
        chosen.append(int(np.argmin(nearness)))
        also = np.abs(accuracy.directions @ accuracy.directions[chosen[-1]])
        nearness = np.maximum(nearness, also)
    return chosen


def view_pictures(
    mesh: TriangleMesh,
    occluder: Occluder,
    accuracy: AccuracyReport,
    count: int = 6,
    device: Device = PROCESSOR,
) -> list[ViewPicture]:
    """The chosen views as pictures of one common scale, the worst first.

    What an occluder has outside of the original's bounding sphere may be cut off.
    """
    chosen = choose_views(accuracy, count)
    originals, hidden = view_masks(mesh, occluder, accuracy.directions[chosen], _MASK, device)
    reach = np.asarray((originals | hidden).any(axis=0))
    frames = zip(
        chosen, _crop_to_frame(originals, reach), _crop_to_frame(hidden, reach), strict=True
    )
    return [
        ViewPicture(
            _name(accuracy, index),
            index,
            accuracy.directions[index],
            viewpoint(accuracy.directions[index], accuracy.options.up),
            float(accuracy.precision_by_view[index]),
            float(accuracy.recall_by_view[index]),
            resize_image(silhouette(original, over), _PICTURE),
        )
        for index, original, over in frames
    ]


def silhouette_sheet(pictures: Sequence[ViewPicture], title: str) -> bytes:
    """All views in one PNG, 1200 pixels wide, a caption under each and a legend at the bottom."""
    rows = -(-len(pictures) // _COLUMNS)
    width, height = _COLUMNS * _CELL + _GAP, _HEAD + rows * (_CELL + _CAPTION) + _FOOT
    corners = [
        (_GAP + place % _COLUMNS * _CELL, _HEAD + place // _COLUMNS * (_CELL + _CAPTION))
        for place in range(len(pictures))
    ]
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor="white")
    figure.text(_GAP, height - _HEAD / 2.0, title, va="center", fontsize=15, **_IN_PIXELS)
    for picture, (left, top) in zip(pictures, corners, strict=True):
        _describe(figure, picture, left, height - top - (_CELL - _GAP))
    _add_legend(figure, _GAP / width, 0.5 * _FOOT / height)
    # matplotlib draws the words only: its images are resampled and take four times as long.
    board = figure_image(figure)
    for picture, (left, top) in zip(pictures, corners, strict=True):
        _paste(board, picture.image, left, top)
    return png_bytes(board)


def _crop_to_frame(masks: BoolArray, reach: BoolArray) -> BoolArray:
    """(n, s, s) masks cut to the smallest centred square that holds ``reach``, with a margin."""
    side = masks.shape[1]
    rows, columns = np.asarray(reach.any(axis=1)), np.asarray(reach.any(axis=0))
    used = rows | rows[::-1] | columns | columns[::-1]
    first = int(np.argmax(used))
    margin = int(_MARGIN * side)
    cut = masks[:, first : side - first, first : side - first]
    return np.pad(cut, ((0, 0), (margin, margin), (margin, margin)))


def resize_image(image: RgbImage, side: int) -> RgbImage:
    """Smoothed to a square of ``side`` pixels; a smaller image keeps its hard pixels."""
    method = cv2.INTER_AREA if len(image) > side else cv2.INTER_NEAREST
    return np.asarray(cv2.resize(image, (side, side), interpolation=method), dtype=np.uint8)


def _name(accuracy: AccuracyReport, index: int) -> str:
    worst = [
        word
        for word, view in (
            ("recall", accuracy.worst_view),
            ("precision", accuracy.worst_precision_view),
        )
        if view == index
    ]
    return f"worst {' and '.join(worst)}" if worst else f"view {index}"


def _paste(board: RgbImage, image: RgbImage, left: int, top: int) -> None:
    """A picture with a thin frame."""
    side = _CELL - _GAP
    panel = board[top : top + side, left : left + side]
    panel[:] = 205
    panel[1:-1, 1:-1] = resize_image(image, side - 2)


def _describe(figure: Figure, picture: ViewPicture, left: float, y: float) -> None:
    """The picture's name in bold and two lines of figures below it; ``y`` pixels from below."""
    colour = "#b3202a" if picture.name.startswith("worst") else "#111111"
    name = picture.name.capitalize()
    figure.text(left, y - 9, name, va="top", color=colour, fontsize=12, **_IN_PIXELS)
    figures = f"recall {percent(picture.recall, 2)}, precision {percent(picture.precision, 2)}"
    lines = f"{figures}\nseen {picture.viewpoint}"
    figure.text(
        left, y - 34, lines, va="top", color="#333333", fontsize=11, linespacing=1.35,
        **_IN_PIXELS | {"fontweight": "normal"},
    )  # fmt: skip


def _add_legend(figure: Figure, x: float, y: float) -> None:
    """What the colours mean, in one line; ``x``, ``y`` of its left end as shares of the figure."""
    labels = ["original and occluder", "original only", "occluder only (hides too much)"]
    colours = np.array([YELLOW, BLACK, BLUE]) / 255.0
    patches = [Patch(color=tuple(c), label=text) for c, text in zip(colours, labels, strict=True)]
    figure.legend(
        handles=patches,
        loc="center left", bbox_to_anchor=(x, y), borderpad=0.0, borderaxespad=0.0, ncols=3,
        frameon=False, fontsize=12,
    )  # fmt: skip
