"""Plane, ImageFrame and Section: a planar cut through the voxel solid and its picture.

Loop, Polygon and Chain: outlines of a section, and their ever simpler versions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray


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


Loop = FloatArray
"""(n, 2) float64 plane coordinates in voxels; closed without repeating the first point."""


@dataclass(frozen=True, eq=False)
class Polygon:
    """One connected piece of a section.

    ``outer``  counter-clockwise :data:`Loop`.
    ``holes``  clockwise loops inside ``outer``.
    """

    outer: Loop
    holes: tuple[Loop, ...] = ()

    @property
    def area(self) -> float:
        """Area of the piece less its holes, in voxel faces."""
        return signed_area(self.outer) + sum(signed_area(hole) for hole in self.holes)


@dataclass(frozen=True, eq=False)
class Chain:
    """A simplification chain (section 4.4 of the paper): one polygon at every triangle count.

    ``plane``   the plane that the polygon lies in, grid space.
    ``ring``    (n, 2) plane coordinates of the full polygon: counter-clockwise and weakly simple
                (bridges to holes run along the same segment twice), so it has n - 2 triangles.
    ``lowest``  (n,) int32: the least number of triangles at which vertex i is still there.  The
                polygon with t triangles keeps the vertices with ``lowest <= t``; there are t + 2.
    """

    plane: Plane
    ring: Loop
    lowest: NDArray[np.int32]

    @property
    def triangles(self) -> int:
        """Triangle count of the full polygon."""
        return len(self.ring) - 2

    def at(self, triangles: int) -> Loop:
        """The polygon with that many triangles (1 to ``self.triangles``)."""
        return np.asarray(self.ring[self.lowest <= triangles])


def signed_area(loop: Loop) -> float:
    """Shoelace area, positive when counter-clockwise, in squared units of the points."""
    x, y = loop[:, 0] - loop[0, 0], loop[:, 1] - loop[0, 1]
    next_x, next_y = np.concatenate((x[1:], x[:1])), np.concatenate((y[1:], y[:1]))
    return float(0.5 * (np.dot(x, next_y) - np.dot(y, next_x)))
