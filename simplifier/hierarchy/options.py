"""What a user can choose for a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

from simplifier.checks import (
    check_above_zero,
    check_flag,
    check_whole,
    check_within,
    settle_numbers,
)
from simplifier.geometry.camera import LEAST_FOV, Lens
from simplifier.options import Axis, make_options

_LARGEST_ERROR = 1000.0  # pixels
_MOST_CHILDREN = 64
_MOST_ROWS = 16_384

COARSENESS = 2.0
"""Voxels of a node that its occluder strays at least, or lacks where it keeps wholly inside."""


@dataclass(frozen=True)
class SceneOptions:
    """How the occluders of a scene are made.

    ``budget``       most triangles of a leaf's near occluder, 1 to 100,000; inner nodes have half
                     of it and far occluders of leaves a quarter, and a mesh of up to four times
                     as many is its own near one.
    ``resolution``   voxels along the longest edge of a node, 1 to 1024; raising it makes occluders
                     of use from nearer by, and costs time.
    ``width``        most children of a node, 2 to 64.
    ``moves``        refining moves a node, 0 to 100,000,000.
    ``up``, ``ground``, ``smallest_hole``, ``conservative``  as for a single mesh; the ground is
                     where each object stands, and the hole is in world units for all.
    ``pixel_error``  largest error of an occluder on the screen, pixels, above 0 and at most 1000;
                     nodes that are never that exact from within the scene get none.
    ``rows``, ``fov``  of the depth buffer: its height in pixels, 1 to 16,384, and its vertical
                     field of view in degrees, 1e-6 to 179.
    ``seed``         of every random choice, 0 to 2**63 - 1.

    Raises :class:`~simplifier.errors.OptionError` for what is out of range.
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
        settle_numbers(self)
        # What a node shares with a single mesh is checked as there; no hole is too long for all.
        make_options(
            math.inf, budget=self.budget, resolution=self.resolution, up=self.up,
            smallest_hole=self.smallest_hole, moves=self.moves, seed=self.seed,
        )  # fmt: skip
        check_flag("ground", self.ground)
        check_flag("conservative", self.conservative)
        check_whole("width", self.width, 2, _MOST_CHILDREN)
        check_whole("rows", self.rows, 1, _MOST_ROWS)
        check_above_zero("pixel error", self.pixel_error, _LARGEST_ERROR)
        check_within("fov", self.fov, LEAST_FOV, 179.0)

    @property
    def lens(self) -> Lens:
        return Lens(self.rows, self.fov)
