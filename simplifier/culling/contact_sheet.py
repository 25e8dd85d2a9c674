"""Some frames of a flythrough in one picture: the view, the occluders, and a plan of each."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from simplifier.culling.fate import Fate
from simplifier.culling.flythrough import Flythrough
from simplifier.culling.flythrough_rows import pixel_words, recall_words
from simplifier.culling.frame import FrameFigures
from simplifier.culling.shot import RED, Shot
from simplifier.culling.top_view import COLOURS, plan_picture, up_axis
from simplifier.report.png import RgbImage, figure_image, png_bytes
from simplifier.wording import count, percent, picture_line, small_percent

# Pixels.
_PICTURE, _PLAN = (384, 216), (270, 216)
_GAP, _CAPTION, _HEAD, _FOOT, _DPI = 8, 56, 92, 48, 100
_CELL = 2 * (_PICTURE[0] + _GAP) + _PLAN[0]
_MARGIN = 28  # between cells
_FRAME, _BLANK = 205, 248
_RING = 12  # radius, pixels of a view
_IN_PIXELS: dict[str, Any] = {"transform": IdentityTransform()}

_LEGEND = (
    (Fate.SEEN, "visible"),
    (Fate.CULLED, "hidden, culled"),
    (Fate.MISSED, "hidden, missed"),
    (Fate.WRONG, "visible, culled: wrong"),
    (Fate.ABSENT, "out of view"),
)


def contact_sheet(flown: Flythrough, scene_name: str) -> bytes:
    """PNG of the shots, two beside each other, captions above them and a legend at the bottom."""
    columns = min(len(flown.shots), 2) or 1
    rows = -(-len(flown.shots) // columns)
    step = (_CELL + _MARGIN, _PICTURE[1] + _CAPTION)
    width, height = columns * step[0] + _MARGIN, _HEAD + rows * step[1] + _FOOT
    corners = [
        (_MARGIN + place % columns * step[0], _HEAD + place // columns * step[1])
        for place in range(len(flown.shots))
    ]
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor="white")
    _write_head(figure, flown, scene_name, height)
    figures = {frame.index: frame.figures for frame in flown.frames}
    for shot, (left, top) in zip(flown.shots, corners, strict=True):
        _write_caption(figure, shot.index, figures[shot.index], left, height - top)
    _add_legend(figure, _MARGIN / width, 0.5 * _FOOT / height)
    # matplotlib draws the words only: its images are resampled and take four times as long.
    board = figure_image(figure)
    boxes, up = flown.parts.scene.bounds(), up_axis(flown.path)
    for shot, (left, top) in zip(flown.shots, corners, strict=True):
        _paste_shot(board, shot, boxes, up, left, top + _CAPTION - _GAP)
    return png_bytes(board)


def _write_head(figure: Figure, flown: Flythrough, scene_name: str, height: int) -> None:
    whole = flown.total
    title = f"{picture_line(scene_name)}, path '{picture_line(flown.path.name)}'"
    lines = (
        f"Parts: {recall_words(whole.parts)}. Objects: {recall_words(whole.objects)}. "
        f"Wrong pixels: {pixel_words(whole)}.\nOccluder triangles: "
        f"{small_percent(whole.triangle_share)} of the scene's.  Each frame: the view, "
        f"the occluders' depth buffer, the parts' boxes from above around the camera."
    )
    figure.text(_MARGIN, height - 14, title, va="top", fontsize=15, fontweight="bold", **_IN_PIXELS)
    figure.text(
        _MARGIN, height - 42, lines, va="top", color="#333333", fontsize=11, linespacing=1.35,
        **_IN_PIXELS,
    )  # fmt: skip


def _write_caption(figure: Figure, index: int, figures: FrameFigures, left: int, y: int) -> None:
    """The frame's number in bold and its figures beside it; ``y`` pixels from below."""
    parts = figures.parts
    recall = "none hidden" if parts.recall is None else f"{percent(parts.recall)} culled"
    wrong = (
        ""
        if not parts.wrong
        else f", {parts.wrong:,} WRONG ({count(figures.wrong_pixels, 'pixel')})"
    )
    occluders = count(figures.occluder_triangles, "occluder triangle")
    words = (
        f"{count(parts.in_view, 'part')} in view, {parts.hidden:,} hidden, {recall}, "
        f"{parts.missed:,} missed{wrong}; {occluders}"
    )
    colour = "#b3202a" if parts.wrong else "#333333"
    figure.text(
        left, y - 24, f"Frame {index}", va="top", fontsize=12, fontweight="bold", **_IN_PIXELS
    )
    figure.text(left + 110, y - 25, words, va="top", color=colour, fontsize=11, **_IN_PIXELS)


def _add_legend(figure: Figure, x: float, y: float) -> None:
    colours = np.array([COLOURS[fate] for fate, _ in _LEGEND]) / 255.0
    patches = [
        Patch(color=tuple(c), label=words) for c, (_, words) in zip(colours, _LEGEND, strict=True)
    ]
    figure.legend(
        handles=patches, loc="center left", bbox_to_anchor=(x, y), borderpad=0.0,
        borderaxespad=0.0, ncols=len(patches), frameon=False, fontsize=12,
    )  # fmt: skip


def _paste_shot(
    board: RgbImage, shot: Shot, boxes: NDArray[np.float64], up: int, left: int, top: int
) -> None:
    aspect = shot.occluders.shape[1] / shot.occluders.shape[0]
    grey = np.repeat(shot.occluders[..., None], 3, axis=2)
    _paste(board, _ring_faults(shot.view), _PICTURE, left, top)
    _paste(board, grey, _PICTURE, left + _PICTURE[0] + _GAP, top)
    inner = (_PLAN[0] - 2, _PLAN[1] - 2)
    plan = plan_picture(shot, boxes, up, inner, aspect)
    _paste(board, plan, _PLAN, left + 2 * (_PICTURE[0] + _GAP), top)


def _paste(board: RgbImage, image: RgbImage, size: tuple[int, int], left: int, top: int) -> None:
    """A picture with a thin frame, as large as fits."""
    width, height = size[0] - 2, size[1] - 2
    scale = min(width / image.shape[1], height / image.shape[0])
    new = max(1, round(scale * image.shape[1])), max(1, round(scale * image.shape[0]))
    method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
    panel = board[top : top + size[1], left : left + size[0]]
    panel[:] = _FRAME
    panel[1:-1, 1:-1] = _BLANK
    x, y = 1 + (width - new[0]) // 2, 1 + (height - new[1]) // 2
    panel[y : y + new[1], x : x + new[0]] = cv2.resize(image, new, interpolation=method)


def _ring_faults(view: RgbImage) -> RgbImage:
    """The view with a ring around what is wrong in it: a pixel or two would not be noticed."""
    places = np.argwhere((view == RED).all(axis=2))
    ringed = view.copy()
    for row, column in np.unique(places // _RING, axis=0) * _RING + _RING // 2:
        cv2.circle(ringed, (int(column), int(row)), _RING, RED, 2, cv2.LINE_AA)
    return ringed
