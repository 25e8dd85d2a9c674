"""Cameras by two directions."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.errors import OptionError
from simplifier.geometry.camera import Camera

UP = np.array([0.0, 0.0, 1.0])


def test_axes_are_orthonormal_whatever_the_lengths():
    camera = Camera.looking(np.ones(3), np.array([3.0, 4.0, 12.0]), 7.0 * UP, 60.0, 0.1)
    assert camera.axes @ camera.axes.T == pytest.approx(np.eye(3), abs=1e-15)
    assert camera.axes[2] == pytest.approx([3 / 13, 4 / 13, 12 / 13])
    assert camera.axes[1] @ UP > 0.0


@pytest.mark.parametrize(
    "forward", [(0, 0, 0), (0, 0, 1), (0, 0, -2), (0, np.inf, 1), (np.nan, 1, 1)]
)
def test_directions_that_make_no_picture_are_refused(forward):
    """Their axes were once NaN, and so was all that was drawn."""
    with pytest.raises(OptionError, match=r"not parallel|three finite numbers"):
        Camera.looking(np.zeros(3), np.array(forward), UP, 60.0, 0.1)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"near": -1.0}, "near"),
        ({"fov": 500.0}, "fov"),
        ({"axes": np.ones((3, 3))}, "axes"),
        ({"axes": np.eye(2)}, "axes"),
        ({"axes": None}, "axes"),
        ({"position": [0.0, np.nan, 0.0]}, "position"),
    ],
)
def test_a_camera_that_could_not_draw_is_refused(changes, name):
    """Only Camera.looking did."""
    good = {"position": [0, 0, 0], "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fov": 60, "near": 1}
    assert Camera(**good).axes.dtype == np.float64
    with pytest.raises(OptionError, match=f"^{name}: "):
        Camera(**{**good, **changes})
