"""Lens, Camera and CameraPath: perspective views, and what a length is in pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray


@dataclass(frozen=True)
class Lens:
    """How large things appear on a screen.

    ``rows``  height of the screen, pixels.
    ``fov``   vertical field of view, degrees.
    """

    rows: int = 1080
    fov: float = 60.0

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
    ``fov``       vertical field of view, degrees, above 0 and below 180.
    ``near``      nothing at less depth is drawn, world units, above 0.
    """

    position: FloatArray
    axes: FloatArray
    fov: float
    near: float

    @classmethod
    def looking(
        cls, position: FloatArray, forward: FloatArray, up: FloatArray, fov: float, near: float
    ) -> Camera:
        """Look along ``forward`` (any length) with ``up`` upwards in the picture.

        Raises :class:`~simplifier.errors.OptionError` where one is zero or not finite, or the two
        are parallel.
        """
        ahead = _unit(forward)
        right = _unit(np.cross(ahead, up))
        axes = np.stack([right, np.cross(right, ahead), ahead])
        return cls(np.asarray(position, dtype=np.float64), axes, fov, near)


def _unit(direction: FloatArray) -> FloatArray:
    length = np.linalg.norm(direction)
    if not 0.0 < length < math.inf:
        raise OptionError(
            "forward and up make no picture",
            where="camera",
            remedy="give two finite directions that are neither zero nor parallel",
        )
    return np.asarray(direction, dtype=np.float64) / length


@dataclass(frozen=True, eq=False)
class CameraPath:
    """Frames of a walk or a flight through a scene, in order; ``name`` says which kind."""

    name: str
    cameras: tuple[Camera, ...]
