"""Where on a mesh recall is lost: which of its places the occluder does not cover, and how often.

Recall is a figure of a view, and a view has no place.  Here every view asks each pixel of the
original's silhouette which point of the mesh it shows, and whether the occluder covers the pixel.
The pixels are counted in the cells of a grid around the bounding sphere rather than by face, so
that a wall of two triangles shows its corners apart, and a million triangles leave no noise.  The
*loss* of a place is the share of the pixels that show it which the occluder does not cover.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simplifier.accuracy.depth_views import DepthViews
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere
from simplifier.kernels.loss import count_losses

CELLS = 64
"""Cells along each side of the cube around the bounding sphere: four pixels each."""


@dataclass(frozen=True, eq=False)
class LossMap:
    """Pixels by the place of the mesh that they show, over all views.

    ``sphere``  the original's bounding sphere; the cube around it is the grid.
    ``seen``    (n, n, n) int64 by x, y and z: pixels that show a point of the mesh in the cell.
    ``lost``    the same, of the pixels that the occluder does not cover.
    """

    sphere: BoundingSphere
    seen: NDArray[np.int64]
    lost: NDArray[np.int64]

    @property
    def share(self) -> float:
        """Of all that the views see, what is not covered; 0 where they see nothing."""
        return float(self.lost.sum() / max(int(self.seen.sum()), 1))

    @property
    def shares(self) -> FloatArray:
        """(n, n, n) float64: the loss of each cell, 0 to 1, and NaN where no view sees the mesh."""
        unseen = np.full(self.seen.shape, np.nan)
        return np.asarray(np.divide(self.lost, self.seen, out=unseen, where=self.seen > 0))


def measure_loss(mesh: TriangleMesh, occluder: Occluder, directions: FloatArray) -> LossMap:
    """Count in orthographic pictures of 256 pixels across the mesh's bounding sphere.

    ``directions``  (V, 3) unit vectors: the viewer looks along them.  Unlike a silhouette, what is
                    seen along a direction is not what is seen along its opposite.

    Raises :class:`~simplifier.errors.MeshError` when the occluder's arrays cannot be drawn and
    :class:`~simplifier.errors.OptionError` for directions that are not unit vectors.
    """
    views = DepthViews.of(mesh, occluder, directions)
    seen, lost = views.counted(partial(count_losses, cells=CELLS))
    return LossMap(views.sphere, seen, lost)
