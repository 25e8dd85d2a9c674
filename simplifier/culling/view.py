"""Camera -> the sixteen numbers that the rasterising kernels take."""

from __future__ import annotations

import numpy as np

from simplifier.checks import check_whole
from simplifier.geometry.camera import Camera, Lens
from simplifier.geometry.mesh import FloatArray

LARGEST_SCREEN = 16384
"""Rows or columns."""


def screen_view(camera: Camera, rows: int, columns: int) -> FloatArray:
    """(16,) float64 as :mod:`simplifier.kernels.perspective` describes it.

    Pixels are square and the axis of view meets the centre of the screen.
    """
    focal = Lens(rows, camera.fov).focal
    right, up, forward = camera.axes
    across = focal * right + 0.5 * columns * forward
    down = -focal * up + 0.5 * rows * forward
    tail = np.array([focal, camera.near, columns, rows])
    return np.concatenate([camera.position, across, down, forward, tail]).astype(np.float64)


def check_screen(rows: int, columns: int) -> None:
    """Raises :class:`OptionError` for a screen that the kernels cannot draw."""
    check_whole("rows", rows, 1, LARGEST_SCREEN)
    check_whole("columns", columns, 1, LARGEST_SCREEN)
