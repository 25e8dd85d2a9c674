"""What an occluder stands before: what moves there vanishes, though it is in plain sight.

Silhouettes cannot tell a bowl from one that is filled, nor a window from a wall.  In every view the
*front* is the number of the original's pixels in which the occluder's nearest surface is nearer
than the original's by more than a hundredth of the bounding sphere's diameter, as a share of the
original's pixels.  What the occluder covers beside the original is its overhang and does not count
here.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from simplifier.accuracy.depth_views import DepthViews
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import FRONT_DEPTH, ViewShares


def measure_front(
    mesh: TriangleMesh, occluder: Occluder, directions: FloatArray, device: Device = PROCESSOR
) -> ViewShares:
    """Measure in orthographic pictures of 256 pixels across the mesh's bounding sphere.

    ``directions``  (V, 3) unit vectors: the viewer looks along them.  Unlike a silhouette, a front
                    along a direction is not that along its opposite.
    ``device``      what draws the pictures; the result is the same on any.

    The share of a view in which the original shows nothing is 0.  Raises
    :class:`~simplifier.errors.MeshError` when the occluder's arrays cannot be drawn and
    :class:`~simplifier.errors.OptionError` for directions that are not unit vectors.
    """
    views = DepthViews.of(mesh, occluder, directions)
    shown, before = views.counted(partial(device.front_pixels, threshold=2.0 * FRONT_DEPTH)).T
    return ViewShares(before / np.maximum(shown, 1), views.lines)
