"""Some frames of a flythrough in one picture: the view, the occluders, and a plan of each."""

from __future__ import annotations

import math
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
from simplifier.culling.upward import up_axis
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray
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
    boxes, up = flown.parts.bounds, up_axis(flown.path)
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


COLOURS = {
    Fate.ABSENT: (214, 214, 210),
    Fate.SEEN: (158, 204, 164),
    Fate.CULLED: (38, 92, 172),
    Fate.MISSED: (242, 150, 22),
    Fate.WRONG: RED,
    Fate.LOST: RED,
}
_BEYOND, _WITHIN, _BLACK = (238, 238, 235), (255, 255, 255), (20, 20, 20)
_BEHIND = 0.1  # of the picture's height, below the camera
_MOST = 0.97  # of the parts in view lie in the picture: a few far ones would make all others small
_FINE = 3  # pixels drawn for one of the picture, along each side
_STEEP = 1e-3  # of a direction's level part; below, there is none


def plan_picture(
    shot: Shot, boxes: FloatArray, up: int, size: tuple[int, int], aspect: float
) -> NDArray[np.uint8]:
    """(h, w, 3) of the parts' boxes (p, 2, 3) around the camera, which looks upwards in it.

    ``size`` is (w, h); ``aspect`` the view's width for its height.  Small boxes lie on large ones,
    and what is culled wrongly on all; the white wedge is what the camera has in view.
    """
    width, height = (_FINE * side for side in size)
    corners = _level(boxes, shot.camera, up)
    scale = _scale(corners[shot.fates != Fate.ABSENT], width, height)
    pixels = np.array([0.5 * width, (1.0 - _BEHIND) * height]) + corners * [scale, -scale]
    picture = np.full((height, width, 3), _BEYOND, dtype=np.uint8)
    wedge = _wedge(shot.camera, aspect, width, height)
    cv2.fillConvexPoly(picture, wedge, _WITHIN, cv2.LINE_AA)
    for part in _order(pixels, shot.fates, width, height):
        _draw_box(picture, pixels[part], Fate(shot.fates[part]))
    for end in wedge[1:]:
        cv2.line(picture, wedge[0].tolist(), end.tolist(), _BLACK, _FINE, cv2.LINE_AA)
    cv2.circle(picture, wedge[0].tolist(), 4 * _FINE, _BLACK, -1, cv2.LINE_AA)
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _level(boxes: FloatArray, camera: Camera, up: int) -> FloatArray:
    """(p, 4, 2) corners of the boxes on the ground: to the camera's right, and ahead of it."""
    one, two = (axis for axis in range(3) if axis != up)
    ahead = camera.axes[2].copy()
    ahead[up] = 0.0
    if np.linalg.norm(ahead) < _STEEP:  # straight down: what is up in the view is ahead
        ahead = camera.axes[1] * np.sign(-camera.axes[2, up])
        ahead[up] = 0.0
    ahead /= np.linalg.norm(ahead)
    skyward = np.zeros(3)
    skyward[up] = -1.0 if camera.axes[1, up] < 0.0 else 1.0
    right = np.cross(ahead, skyward)
    sides = boxes - camera.position
    ground = np.empty((len(boxes), 4, 2))
    for corner, (first, second) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        place = np.stack([sides[:, first, one], sides[:, second, two]], axis=1)
        ground[:, corner] = place @ np.array([[right[one], ahead[one]], [right[two], ahead[two]]])
    return ground


def _scale(corners: FloatArray, width: int, height: int) -> float:
    """Pixels for a unit of length, so that most of the parts in view are in the picture."""
    if len(corners) == 0:
        return 1.0
    middles = corners.mean(axis=1)
    far = float(np.quantile(middles[:, 1], _MOST))
    wide = float(np.quantile(np.abs(middles[:, 0]), _MOST))
    fits = ((1.0 - _BEHIND) * height / max(far, 1e-9), 0.5 * width / max(wide, 1e-9))
    return 0.93 * min(fits)


def _wedge(camera: Camera, aspect: float, width: int, height: int) -> NDArray[np.int32]:
    """(3, 2) pixels: the camera, and where the sides of its view leave the picture."""
    slope = aspect * math.tan(math.radians(0.5 * camera.fov))
    reach = 2.0 * (width + height)
    top = np.array([0.5 * width, (1.0 - _BEHIND) * height])
    length = reach / math.hypot(1.0, slope)
    ends = top + length * np.array([[-slope, -1.0], [slope, -1.0]])
    return np.round(np.vstack([top, ends])).astype(np.int32)


def _order(
    pixels: FloatArray, found: NDArray[np.uint8], width: int, height: int
) -> NDArray[np.int64]:
    """Parts in the picture: those out of view, then from large to small, then the wrong ones."""
    low, high = pixels.min(axis=1), pixels.max(axis=1)
    inside = ((high >= 0.0) & (low <= [width, height])).all(axis=1)
    layer = np.where(found == Fate.ABSENT, 0, np.where(found >= Fate.WRONG, 2, 1))
    area = (high - low).prod(axis=1)
    order = np.lexsort((-area, layer))
    return np.asarray(order[inside[order]])


def _draw_box(picture: NDArray[np.uint8], corners: FloatArray, fate: Fate) -> None:
    # Far out of the picture, coordinates would overflow.
    outline = np.round(np.clip(corners, -1e5, 1e5)).astype(np.int32)
    colour = COLOURS[fate]
    cv2.fillConvexPoly(picture, outline, colour, cv2.LINE_AA)
    alarm = fate in (Fate.WRONG, Fate.LOST)
    edge = _BLACK if alarm else tuple(int(0.72 * value) for value in colour)
    cv2.polylines(picture, [outline], True, edge, 2 if alarm else 1, cv2.LINE_AA)
    if alarm:  # also where the box is a pixel
        cv2.circle(
            picture, outline.mean(axis=0).round().astype(int).tolist(), 6 * _FINE, colour, _FINE + 1
        )
