"""Plane, ImageFrame and Section: a planar cut through the voxel solid and its picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane in grid space with its own 2D coordinates.

    ``axes``   (3, 3) rows u, v, d: orthonormal, right-handed; d is the plane's normal.
    ``depth``  distance of the plane from the grid's origin along d, in voxels.
    """

    axes: FloatArray
    depth: float

    def to_space(self, points: FloatArray) -> FloatArray:
        """Plane coordinates (n, 2) to grid space (n, 3)."""
        u, v, d = self.axes
        return np.asarray(points[:, :1] * u + points[:, 1:] * v + self.depth * d)


@dataclass(frozen=True, eq=False)
class ImageFrame:
    """Where the pictures of all sections of one direction lie.

    ``axes``    (3, 3) rows u, v, d as in :class:`Plane`.
    ``corner``  (2,) plane coordinates of the outer corner of pixel (0, 0), in voxels.
    ``rows``, ``columns``  image size; row r, column c has its centre at
                ``corner + pixel * (c + 0.5, r + 0.5)``; rows go along +v, columns along +u.
    ``pixel``   edge of a pixel, in voxels.
    """

    axes: FloatArray
    corner: FloatArray
    rows: int
    columns: int
    pixel: float


@dataclass(frozen=True, eq=False)
class Section:
    """The slice of the solid by one plane, as a picture.

    ``plane``   the cutting plane, grid space.
    ``mask``    (rows, columns) bool: the pixel's centre lies in the solid.
    ``corner``, ``pixel``  as in :class:`ImageFrame`.
    """

    plane: Plane
    mask: BoolArray
    corner: FloatArray
    pixel: float
