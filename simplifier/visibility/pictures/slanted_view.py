"""A view cell and an object's box -> a view from above, past the one at the other."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray

_TURN, _DOWN = math.radians(28.0), math.radians(33.0)  # off the line from the cell, and downwards
_FAR = 14.0  # lengths of what is shown: so far away, lines hardly run together
_MARGIN = 1.1
_FLATTEST, _TALLEST = 0.5, 0.85  # height of the picture for its width
_NEAREST = 0.02  # of the distance


@dataclass(frozen=True, eq=False)
class SlantedView:
    """``camera`` in upright space; ``tall`` is the height of its picture, whose width is 1."""

    camera: Camera
    tall: float

    @classmethod
    def past(cls, cell: FloatArray, box: FloatArray) -> SlantedView:
        """Of both boxes (2, 3), the cell in front."""
        both = np.array([np.minimum(cell[0], box[0]), np.maximum(cell[1], box[1])])
        towards = (box - cell).mean(axis=0)
        ahead = math.atan2(towards[1], towards[0]) + _TURN
        forward = np.array([
            math.cos(_DOWN) * math.cos(ahead), math.cos(_DOWN) * math.sin(ahead), -math.sin(_DOWN)
        ])  # fmt: skip
        distance = _FAR * float(np.linalg.norm(both[1] - both[0]))
        up = np.array([0.0, 0.0, 1.0])
        place = both.mean(axis=0) - distance * forward
        rough = Camera.looking(place, forward, up, 90.0, _NEAREST * distance)
        corners = np.concatenate([_corners(cell), _corners(box)]) - place
        across, above, depth = rough.axes @ corners.T
        x, y = across / depth, above / depth
        middle = 0.5 * np.array([x.min() + x.max(), y.min() + y.max()])
        camera = replace(rough, position=place + distance * (middle @ rough.axes[:2]))
        wide, high = _MARGIN * np.ptp(x), _MARGIN * np.ptp(y)
        tall = float(np.clip(high / wide, _FLATTEST, _TALLEST))
        half = 0.5 * max(high, tall * wide)
        return cls(replace(camera, fov=math.degrees(2.0 * math.atan(half))), tall)

    def on_picture(self, points: FloatArray) -> FloatArray:
        """(…, 2) of upright points (…, 3): 0 to 1 from the left and 0 to ``tall`` from below."""
        seen = (points - self.camera.position) @ self.camera.axes.T
        half = math.tan(math.radians(0.5 * self.camera.fov))
        scale = 0.5 * self.tall / half
        places = scale * seen[..., :2] / seen[..., 2:]
        return np.asarray(places + np.array([0.5, 0.5 * self.tall]))

    def points(self, depth: FloatArray) -> FloatArray:
        """(rows, columns, 3) upright points of a picture of depths (rows, columns)."""
        rows, columns = depth.shape
        step = 2.0 * math.tan(math.radians(0.5 * self.camera.fov)) / rows
        across = step * (np.arange(columns) + 0.5 - 0.5 * columns)
        above = step * (0.5 * rows - 0.5 - np.arange(rows))
        right, up, forward = self.camera.axes
        rays = forward + across[:, None] * right + above[:, None, None] * up
        return np.asarray(self.camera.position + depth[..., None] * rays)


def _corners(box: FloatArray) -> FloatArray:
    """(8, 3) of a box (2, 3)."""
    return np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
