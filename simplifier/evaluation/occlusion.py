"""The total occlusion measure of an original and its occluder, for the report."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.errors import MeshError
from simplifier.evaluation.accuracy import view_masks
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, hemisphere_directions
from simplifier.selection.measure import directional_measures

_DIRECTIONS = 64  # even over a hemisphere: the mean then moves by less than half a percent
_SMALLEST, _LARGEST = 1e-98, 1e100  # world units; cubes of a pixel's edge keep all digits
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
    """Measure both from 64 even directions, in images of 128 pixels a side.

    Raises :class:`MeshError` for a mesh of which 64 bits hold no volume.
    """
    radius = BoundingSphere.of(mesh).radius
    if not _SMALLEST <= radius <= _LARGEST:
        raise MeshError(
            f"the mesh has a radius of {radius:.3g}, and a volume of that size is no 64-bit number",
            remedy=f"scale it {'up' if radius < 1.0 else 'down'}",
        )
    original, hidden = view_masks(mesh, occluder, hemisphere_directions(_DIRECTIONS), _IMAGE)
    pixel = 2.0 * radius / _IMAGE
    return OcclusionMeasures(
        occluder=float(directional_measures(hidden).mean()) * pixel**3,
        original=float(directional_measures(original).mean()) * pixel**3,
    )
