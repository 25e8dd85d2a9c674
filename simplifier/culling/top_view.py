"""A shot from above: where what is seen, culled, missed and wrongly culled stands."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from simplifier.culling.fate import Fate
from simplifier.culling.shot import RED, Shot
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.mesh import FloatArray

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
_LEVEL = 30.0  # weight of being level: steep cameras tell by it alone, rolled ones spoil it
_STEEP = 1e-3  # of a direction's level part; below, there is none


def up_axis(path: CameraPath) -> int:
    """0 to 2: the axis that is upwards along the path.

    It is upright in the pictures, and level in none: a camera that looks steeply down has its own
    up far from it, but its right is level.
    """
    score = np.zeros(3)
    for camera in path.cameras:
        score += camera.axes[1] ** 2 - _LEVEL * camera.axes[0] ** 2
    return int(np.argmax(score))


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
