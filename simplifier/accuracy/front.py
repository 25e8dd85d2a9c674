"""What an occluder stands before: what moves there vanishes, though it is in plain sight.

Silhouettes cannot tell a bowl from one that is filled, nor a window from a wall.  In every view the
*front* is the number of the original's pixels in which the occluder's nearest surface is nearer
than the original's by more than a hundredth of the bounding sphere's diameter, as a share of the
original's pixels.  What the occluder covers beside the original is its overhang and does not count
here.
"""

from __future__ import annotations

import numpy as np

from simplifier.accuracy.accuracy import checked_directions
from simplifier.device.device import PROCESSOR, Device
from simplifier.errors import MeshError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import FRONT_DEPTH, BoundingSphere, ViewShares, image_axes

ACROSS = 256
"""Pixels across the original's bounding sphere."""


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
    lines = checked_directions(directions)
    sphere = BoundingSphere.of(mesh)
    projections = np.zeros((len(lines), 3, 4))
    projections[:, :, :3] = image_axes(lines)
    projections[:, :2] *= ACROSS / 2.0
    projections[:, :2, 3] = ACROSS / 2.0
    own = sphere.to_unit(mesh.vertices), mesh.faces
    other = sphere.to_unit(occluder.vertices), occluder.faces
    try:
        pixels = device.front_pixels(own, other, projections, ACROSS, 2.0 * FRONT_DEPTH)
    except ValueError as error:
        raise MeshError(str(error), where="occluder", remedy="repair its arrays") from error
    shown, before = pixels.T
    return ViewShares(before / np.maximum(shown, 1), lines)
