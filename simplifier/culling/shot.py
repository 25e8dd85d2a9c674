"""Shot: what a contact sheet shows of one frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.fate import Fate
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray

RED = (200, 0, 40)
_PAPER = (250.0, 250.0, 248.0)
_WIDEST = 640  # pixels of a picture that is kept

# Muted, told apart by lightness as well as by hue, none near to red.
_OBJECTS = np.array([
    (135, 171, 201), (214, 196, 144), (121, 160, 140), (190, 174, 205), (232, 214, 190),
    (98, 130, 165), (171, 190, 155), (157, 143, 175), (205, 220, 224), (181, 158, 122),
    (150, 196, 190),
], dtype=np.float64)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Shot:
    """Pictures of one frame, and what became of the parts in it.

    ``index``      of the frame in its path.
    ``view``       (h, w, 3) uint8: objects in colours of their own, shaded; red what is visible but
                   was culled.
    ``occluders``  (rows, columns) uint8: the depth buffer, white is near and black is nothing.
    ``fates``      (p,) :class:`Fate` of the parts.
    """

    index: int
    camera: Camera
    view: NDArray[np.uint8]
    occluders: NDArray[np.uint8]
    fates: NDArray[np.uint8]


def view_picture(
    truth: ItemBuffer, camera: Camera, object_of: IntArray, found: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """(h, w, 3) of what the item buffer holds, smoothed to about 640 columns at most.

    ``object_of``, ``found``  (p,) of the parts, which are the items: their objects and fates.
    """
    step = max(1, truth.columns // (2 * _WIDEST))  # large pictures would take gigabytes
    items, depth = truth.items[::step, ::step], truth.depth[::step, ::step]
    colours = _OBJECTS[object_of[items] % len(_OBJECTS)] * _shade(depth, camera)[..., None]
    factor = max(1, round(depth.shape[1] / _WIDEST))
    picture = _smooth(np.where(items[..., None] >= 0, colours, _PAPER), factor)
    # A culled pixel is not to fade among its neighbours: one makes its square red.
    bad = (truth.items >= 0) & np.isin(found[truth.items], (Fate.WRONG, Fate.LOST))
    rows, columns = np.argwhere(bad).T // (step * factor)
    last = np.array(picture.shape[:2]) - 1
    picture[np.minimum(rows, last[0]), np.minimum(columns, last[1])] = RED
    return np.minimum(picture, 255.0).astype(np.uint8)


def _shade(depth: FloatArray, camera: Camera) -> FloatArray:
    """(rows, columns) 0.4 to 1.08 by the side that a surface turns to the camera, and distance."""
    near = np.where(np.isfinite(depth), depth, 0.0)
    normals = _normals(near, camera)
    # Light from over the left shoulder: three sides of a box get three greys.
    light = np.array([-0.45, 0.75, -0.5]) / np.linalg.norm([-0.45, 0.75, -0.5])
    lit = 0.7 + 0.25 * (normals @ light) + 0.15 * np.abs(normals[..., 2])
    seen = near[near > 0.0]
    far = float(np.quantile(seen, 0.95)) if len(seen) else 1.0
    return np.asarray(np.clip(lit, 0.5, 1.08) * (1.0 - 0.15 * np.minimum(near / far, 1.0)))


def _normals(depth: FloatArray, camera: Camera) -> FloatArray:
    """(rows, columns, 3) in view space (right, up, forward), of unit length, towards the camera."""
    rows, columns = depth.shape
    slope = np.tan(np.radians(0.5 * camera.fov)) / (0.5 * rows)
    across = slope * (np.arange(columns) + 0.5 - 0.5 * columns)
    up = -slope * (np.arange(rows) + 0.5 - 0.5 * rows)
    points = np.stack([depth * across, depth * up[:, None], depth], axis=-1)
    normals = np.cross(_step(points, 1), _step(points, 0))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    # By the line of sight: level ground has nothing forward in its normal but rounding.
    away = (normals * points).sum(axis=-1, keepdims=True) > 0.0
    return np.where(away, -normals, normals)


def _step(points: FloatArray, axis: int) -> FloatArray:
    """To the next point along an axis or from the one before, whichever is nearer in depth.

    Of two neighbours one is most often on the same surface.
    """
    ahead = np.diff(points, axis=axis)
    pad = [(0, 0)] * 3
    forth, back = list(pad), list(pad)
    forth[axis], back[axis] = (0, 1), (1, 0)
    onward, past = np.pad(ahead, forth, mode="edge"), np.pad(ahead, back, mode="edge")
    nearer = np.abs(onward[..., 2:]) <= np.abs(past[..., 2:])
    return np.where(nearer, onward, past)


def _smooth(picture: FloatArray, factor: int) -> FloatArray:
    """Means over squares of ``factor`` pixels; what is left over at the far edges is cut off."""
    rows, columns = (size // factor for size in picture.shape[:2])
    cut = picture[: rows * factor, : columns * factor]
    return np.asarray(cut.reshape(rows, factor, columns, factor, -1).mean(axis=(1, 3)))
