"""Loop, Polygon and Chain: outlines of a section, and their ever simpler versions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.section import Plane

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
    return float(0.5 * (np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))
