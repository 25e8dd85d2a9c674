"""Where an occluder stands in front of its original, in the pictures of a search."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.kernels.bit_image import SIZE
from simplifier.kernels.soup_views import FRONT_ROWS, FRONT_STEP


def lines_of_sight(projections: FloatArray) -> FloatArray:
    """(V, 3) unit vectors along which projections (V, 2, 4) look, either way."""
    across = np.cross(projections[:, 0, :3], projections[:, 1, :3])
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class Depths:
    """Depths before which an occluder is in front of the original, by view.

    ``away``    (V, 4) planes of depth: that of a point p is ``away[:3] @ p + away[3]``.
    ``limits``  (V, rows, columns) float32, -inf where the original does not show.
    """

    away: FloatArray
    limits: NDArray[np.float32]

    @property
    def known(self) -> bool:
        """Whether there are any."""
        return len(self.limits) > 0

    @classmethod
    def of(
        cls,
        vertices: FloatArray,
        faces: IntArray,
        projections: FloatArray,
        size: int,
        tolerance: float,
        turned: bool,
        device: Device = PROCESSOR,
    ) -> Depths:
        """Of a mesh in square pictures.

        ``projections``  (V, 2, 4) to 64 x 64 pixels, as a search has them.
        ``size``         pixels a side.
        ``tolerance``    units of depth by which an occluder may stand before the surface.
        ``turned``       whether every other view looks the opposite way: what is in front along a
                         line of sight is not what is in front along its opposite.
        """
        away = np.zeros((len(projections), 4))
        away[:, :3] = lines_of_sight(projections)
        if turned:
            away[::2] *= -1.0
        maps = with_depth(projections * (size / SIZE), away)
        return cls(away, device.depth_limits(vertices, faces, maps, size, tolerance))

    def rows_of_search(self) -> Depths:
        """Those rows of 64 that a search looks at."""
        return Depths(
            self.away, np.ascontiguousarray(self.limits[:, FRONT_STEP // 2 :: FRONT_STEP])
        )

    def arrays(self) -> tuple[FloatArray, NDArray[np.float32], NDArray[np.float32]]:
        """As :mod:`simplifier.kernels.soup_views` takes them."""
        return self.away, self.limits, self._highest

    @cached_property
    def _highest(self) -> NDArray[np.float32]:
        return np.asarray(self.limits.max(axis=2, initial=-np.inf))


NO_DEPTHS = Depths(np.empty((0, 4)), np.empty((0, FRONT_ROWS, SIZE), dtype=np.float32))


def with_depth(projections: FloatArray, away: FloatArray) -> FloatArray:
    """(V, 3, 4) maps to x, y and depth."""
    return np.concatenate([projections, away[:, None]], axis=1)
