"""What a user can choose for a scene."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.errors import OptionError
from simplifier.geometry.camera import Lens
from simplifier.options import MOST_VOXELS, Axis

COARSENESS = 2.0
"""Voxels of a node that its occluder strays at least, or lacks where it keeps wholly inside."""


@dataclass(frozen=True)
class SceneOptions:
    """How the occluders of a scene are made.

    ``budget``       most triangles of a node's occluder, 1 to 100,000.
    ``resolution``   voxels along the longest edge of a node, 1 to 1024; raising it makes occluders
                     of use from nearer by, and costs time.
    ``width``        most children of a node, 2 to 64.
    ``moves``        refining moves a node, 0 to 100,000,000.
    ``up``, ``ground``, ``smallest_hole``, ``conservative``  as for a single mesh; the ground is
                     where each object stands.
    ``pixel_error``  largest error of an occluder on the screen, pixels, above 0; nodes that are
                     never that exact from within the scene get none.
    ``rows``, ``fov``  of the depth buffer: its height in pixels and vertical degrees.
    ``seed``         of every random choice.
    """

    budget: int = 64
    resolution: int = 64
    width: int = 8
    moves: int = 2400
    up: Axis = "y"
    ground: bool = False
    smallest_hole: float = 0.0
    conservative: bool = False
    pixel_error: float = 0.5
    rows: int = 180
    fov: float = 60.0
    seed: int = 0

    def __post_init__(self) -> None:
        _whole("resolution", self.resolution, 1, MOST_VOXELS)
        _whole("width", self.width, 2, 64)
        _whole("rows", self.rows, 1, 16384)
        if not 0.0 < self.pixel_error <= 1000.0:
            raise _out_of_range("pixel error", self.pixel_error, "above 0 and at most 1000")
        if not 0.0 < self.fov < 180.0:
            raise _out_of_range("fov", self.fov, "above 0 and below 180 degrees")

    @property
    def lens(self) -> Lens:
        return Lens(self.rows, self.fov)


def _whole(name: str, value: int, low: int, high: int) -> None:
    if not isinstance(value, int) or not low <= value <= high:
        raise _out_of_range(name, value, f"{low:,} to {high:,}")


def _out_of_range(name: str, value: object, allowed: str) -> OptionError:
    return OptionError(f"{value!r} is out of range", where=name, remedy=f"choose {allowed}")
