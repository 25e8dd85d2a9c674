"""Which way is up along a camera path."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.camera import CameraPath

_LEVEL = 30.0  # weight of being level: steep cameras tell by it alone, rolled ones spoil it


def up_axis(path: CameraPath) -> int:
    """0 to 2: the axis that is upwards along the path.

    It is upright in the pictures, and level in none: a camera that looks steeply down has its own
    up far from it, but its right is level.
    """
    score = np.zeros(3)
    for camera in path.cameras:
        score += camera.axes[1] ** 2 - _LEVEL * camera.axes[0] ** 2
    return int(np.argmax(score))
