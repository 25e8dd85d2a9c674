"""A camera path: refused, or cameras that something can be drawn with."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import CameraPath
from simplifier.io.camera_path import load_camera_path, save_camera_path
from tests.fuzz.promises import promise

_DIGITS = 1e-9
_WALL = np.array([[[-9.0, -9.0, 5.0], [9.0, -9.0, 5.0], [0.0, 9.0, 5.0]]])
_BOX = np.array([[[-1.0, -1.0, 7.0], [1.0, 1.0, 9.0]]])


def check_camera_path(path: Path) -> None:
    """Raises ``OccluderError`` for one that is refused."""
    found = load_camera_path(path)
    _check_cameras(found)
    copy = path.with_name("copy.json")
    save_camera_path(found, copy)
    again = load_camera_path(copy)
    promise(again.name == found.name, "a path keeps its name")
    promise(len(again.cameras) == len(found.cameras), "a path keeps its frames")
    for one, other in zip(found.cameras, again.cameras, strict=True):
        same = np.array_equal(one.position, other.position)
        promise(same and (one.fov, one.near) == (other.fov, other.near), "a camera keeps its place")
        promise(np.allclose(one.axes, other.axes, rtol=0, atol=_DIGITS), "and looks where it did")


def _check_cameras(found: CameraPath) -> None:
    promise(found.cameras, "a path has a frame")
    found.name.encode()
    for camera in found.cameras:
        promise(np.isfinite(camera.position).all(), "positions are finite")
        turns = camera.axes @ camera.axes.T
        promise(np.allclose(turns, np.eye(3), rtol=0, atol=_DIGITS), "axes are orthonormal")
        promise(0.0 < camera.fov < 180.0 and 0.0 < camera.near < np.inf, "a camera sees something")
        buffer = DepthBuffer(9, 16)
        buffer.draw(_WALL, camera, 0.1)
        promise(set(buffer.test(_BOX, camera).tolist()) <= set(Verdict), "and something is judged")
