"""The total occlusion measure of an original and its occluder, for the report."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.accuracy.accuracy import view_masks
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, hemisphere_directions
from simplifier.selection.measure import directional_measures

DIRECTIONS = 64
"""Even over a hemisphere: the mean then moves by less than half a percent."""

IMAGE = 128
"""Pixels over the bounding sphere, a side."""


@dataclass(frozen=True)
class OcclusionMeasures:
    """Mean over directions of the exact measure (equations 2 and 3).

    ``occluder``, ``original``  cubic world units; 0 where a mesh is so small that float64 has none.
    ``ratio``                   share of the original's measure that the occluder has, at any size;
                                above 1 when it over-occludes.
    """

    occluder: float
    original: float
    ratio: float


def occlusion_measures(
    mesh: TriangleMesh, occluder: Occluder, device: Device = PROCESSOR
) -> OcclusionMeasures:
    """Measure both from 64 even directions, in images of 128 pixels a side."""
    lines = hemisphere_directions(DIRECTIONS)
    original, hidden = view_masks(mesh, occluder, lines, IMAGE, device)
    pixel = 2.0 * BoundingSphere.of(mesh).radius / IMAGE
    there, here = (float(directional_measures(masks).mean()) for masks in (hidden, original))
    return OcclusionMeasures(
        occluder=there * pixel**3,
        original=here * pixel**3,
        ratio=there / here if here > 0.0 else 0.0,
    )
