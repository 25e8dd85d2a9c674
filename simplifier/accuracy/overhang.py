"""What an occluder covers beside its original: what stands there vanishes from sight.

Precision by quads hardly sees it, as a spike along the outline holds no large quad; a viewer sees
it at once.  In every view the *overhang* is the number of pixels that the occluder covers more than
one pixel away from the original's silhouette, even across a corner, as a share of the original's
pixels; the *stick-out* is how far from the silhouette the furthest of them is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simplifier.accuracy.accuracy import checked_directions
from simplifier.accuracy.silhouette_views import SilhouetteViews
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, ViewShares
from simplifier.kernels.overhang import shares_beside

ACROSS = 512
"""Pixels across the original's bounding sphere."""

_LARGEST = 2048  # pixels a side of a picture, of an occluder that is much larger than its original


@dataclass(frozen=True, eq=False, repr=False)
class Overhang(ViewShares):
    """How far and how much an occluder sticks out.

    ``by_view``    covered pixels beside the original as a share of the original's; where the
                   original shows nothing 1 if the occluder shows anything, else 0.
    ``stick_out``  world units: the largest distance of such a pixel from the silhouette, over all
                   views in which the original shows.
    """

    stick_out: float


def measure_overhang(
    mesh: TriangleMesh, occluder: Occluder, directions: FloatArray, device: Device = PROCESSOR
) -> Overhang:
    """Measure in orthographic pictures of 512 pixels across the mesh's bounding sphere.

    ``directions``  (V, 3) unit vectors, the lines of sight.
    ``device``      what draws the pictures; the result is the same on any.

    Pictures are larger where the occluder reaches past the sphere, up to four times; what sticks
    out further than that is not counted.  Raises :class:`~simplifier.errors.MeshError` when the
    occluder's arrays cannot be drawn and :class:`~simplifier.errors.OptionError` for directions
    that are not unit vectors.
    """
    return measure_overhangs(mesh, [occluder], directions, device)[0]


def measure_overhangs(
    mesh: TriangleMesh,
    occluders: Sequence[Occluder],
    directions: FloatArray,
    device: Device = PROCESSOR,
) -> tuple[Overhang, ...]:
    """As :func:`measure_overhang` each, but the mesh is drawn once for all."""
    lines = checked_directions(directions)
    sphere = BoundingSphere.of(mesh)
    image = max((_image_size(sphere.to_unit(one.vertices)) for one in occluders), default=ACROSS)
    views = SilhouetteViews.of(mesh, occluders, lines, image, ACROSS)
    counted = [views.counted(device.overhang_pixels, *block) for block in views.blocks()]
    pixels, farthest = (np.concatenate(one, axis=1) for one in zip(*counted, strict=True))
    pixel = 2.0 * sphere.radius / ACROSS
    return tuple(
        Overhang(shares_beside(*beside.T), lines, math.sqrt(max(int(far.max()), 0)) * pixel)
        for beside, far in zip(pixels, farthest, strict=True)
    )


def _image_size(occluder: FloatArray) -> int:
    """Pixels a side that hold an occluder in units of the sphere, at least the sphere itself."""
    squares = (occluder**2).sum(axis=1)
    reach = math.sqrt(float(squares[np.isfinite(squares)].max(initial=1.0)))
    return min(2 * math.ceil(ACROSS / 2 * max(reach, 1.0)) + 2, _LARGEST)
