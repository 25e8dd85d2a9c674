"""Lens, Camera and CameraPath: perspective views, and what a length is in pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from simplifier.checks import check_positive, check_whole, is_number, value_text
from simplifier.errors import OptionError
from simplifier.geometry.arrays import vector
from simplifier.geometry.mesh import FloatArray
from simplifier.options.scene import LEAST_FOV

_MOST_ROWS = 1 << 31  # of a screen; a larger one is a mistake
"""Degrees; of less, lengths in pixels grow past all floats."""


@dataclass(frozen=True)
class Lens:
    """How large things appear on a screen.

    ``rows``  height of the screen, pixels.
    ``fov``   vertical field of view, degrees, at least :data:`LEAST_FOV` and below 180.

    Raises :class:`~simplifier.errors.OptionError`.
    """

    rows: int = 1080
    fov: float = 60.0

    def __post_init__(self) -> None:
        check_whole("rows", self.rows, 1, _MOST_ROWS)
        _check_fov(self.fov)

    @property
    def focal(self) -> float:
        """Pixels that a unit length takes at unit distance (pixels are square)."""
        return 0.5 * self.rows / math.tan(math.radians(0.5 * self.fov))

    def distance(self, length: float, pixels: float) -> float:
        """The least distance from which a length stays within that many pixels."""
        return length * self.focal / pixels


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective view.

    ``position``  (3,) float64, world units.
    ``axes``      (3, 3) rows right, up, forward: orthonormal; a point's view coordinates are
                  ``axes @ (point - position)``, the third is its depth.
    ``fov``       vertical field of view, degrees, at least :data:`LEAST_FOV` and below 180.
    ``near``      nothing at less depth is drawn, world units, above 0.

    Raises :class:`~simplifier.errors.OptionError`.
    """

    position: FloatArray
    axes: FloatArray
    fov: float
    near: float

    def __post_init__(self) -> None:
        check_positive("near", self.near)
        _check_fov(self.fov)
        object.__setattr__(self, "position", vector("position", self.position))
        axes = np.stack([vector("axes", row) for row in _rows(self.axes)])
        if not np.allclose(axes @ axes.T, np.eye(3), atol=_SQUARE):
            raise OptionError(
                "the rows are not orthonormal", where="axes", remedy="make them by Camera.looking"
            )
        object.__setattr__(self, "axes", axes)

    @classmethod
    def looking(
        cls, position: FloatArray, forward: FloatArray, up: FloatArray, fov: float, near: float
    ) -> Camera:
        """Look along ``forward`` (any length) with ``up`` upwards in the picture.

        Raises :class:`~simplifier.errors.OptionError` for what is no view: a vector of length 0,
        two that are parallel, a ``fov`` or ``near`` out of range.
        """
        ahead = _unit(vector("forward", forward), "forward")
        right = _unit(np.cross(ahead, _unit(vector("up", up), "up")), "up")
        axes = np.stack([right, np.cross(right, ahead), ahead])
        return cls(position, axes, fov, near)


def _unit(vector: FloatArray, name: str) -> FloatArray:
    length = np.linalg.norm(vector)
    if not 0.0 < length < math.inf:
        raise OptionError(
            f"a direction of length {length:g}",
            where=name,
            remedy="give vectors with a length, which are not parallel",
        )
    return np.asarray(vector / length)


_SQUARE = 1e-6  # of a product of two rows: what numbers of a file are rounded by


def _rows(axes: Any) -> list[Any]:
    rows = list(axes) if isinstance(axes, (list, tuple, np.ndarray)) else []
    if len(rows) != 3:
        raise OptionError(
            f"{value_text(axes)} is no matrix of three rows", where="axes", remedy="give (3, 3)"
        )
    return rows


def _check_fov(fov: float) -> None:
    if not is_number(fov) or not LEAST_FOV <= fov < 180.0:
        raise OptionError(
            f"{value_text(fov)} is out of range",
            where="fov",
            remedy="choose between 0 and 180 degrees",
        )


@dataclass(frozen=True, eq=False)
class CameraPath:
    """Frames of a walk or a flight through a scene, in order; ``name`` says which kind."""

    name: str
    cameras: tuple[Camera, ...]
