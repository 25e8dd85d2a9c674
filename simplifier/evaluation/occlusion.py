"""The total occlusion measure of an original and its occluder, for the report."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.evaluation.accuracy import view_masks
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, hemisphere_directions
from simplifier.selection.measure import directional_measures

_DIRECTIONS = 64  # even over a hemisphere: the mean then moves by less than half a percent
_IMAGE = 128  # pixels over the bounding sphere, a side


@dataclass(frozen=True)
class OcclusionMeasures:
    """Mean over directions of the exact measure (equations 2 and 3), cubic world units."""

    occluder: float
    original: float

    @property
    def ratio(self) -> float:
        """Share of the original's measure that the occluder has; above 1 when it over-occludes."""
        return self.occluder / self.original if self.original > 0.0 else 0.0


def occlusion_measures(mesh: TriangleMesh, occluder: Occluder) -> OcclusionMeasures:
    """Measure both from 64 even directions, in images of 128 pixels a side."""
    original, hidden = view_masks(mesh, occluder, hemisphere_directions(_DIRECTIONS), _IMAGE)
    pixel = 2.0 * BoundingSphere.of(mesh).radius / _IMAGE
    return OcclusionMeasures(
        occluder=float(directional_measures(hidden).mean()) * pixel**3,
        original=float(directional_measures(original).mean()) * pixel**3,
    )
