"""Solid -> projections: where the search looks from, and how its pictures are framed."""

from __future__ import annotations

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import Solid
from simplifier.geometry.views import from_above, hemisphere_directions, image_axes
from simplifier.options import Options
from simplifier.selection.measure import fitted_projections

_SEEN = 1.5  # voxels about a voxel's centre that pictures show: triangles may reach that far


def search_projections(
    solid: Solid, options: Options, count: int, margin: float = 0.0
) -> FloatArray:
    """(count, 2, 4) maps from grid space, shifted by ``margin``, to 64 x 64 pictures."""
    directions = hemisphere_directions(count)
    if options.viewers == "above":
        directions = from_above(directions, "xyz".index(options.solid.up))
    return fitted_projections(image_axes(directions), solid.filled.column_ends() + margin, _SEEN)
