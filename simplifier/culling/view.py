"""Camera -> the sixteen numbers that the rasterising kernels take."""

from __future__ import annotations

import numpy as np

from simplifier.errors import OptionError
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
    if not (1 <= rows <= LARGEST_SCREEN and 1 <= columns <= LARGEST_SCREEN):
        raise OptionError(
            f"a screen of {rows} x {columns} pixels",
            remedy=f"give 1 to {LARGEST_SCREEN} rows and columns",
        )
