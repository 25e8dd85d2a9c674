"""Triangles of the mesh itself: what has no more than the budget is its own best occluder.

It hides exactly what the original hides and strays from it nowhere.  Pictures could only spoil it:
a needle is thinner than any pixel, and a search that cannot see it finds nothing, or too much.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.overrides import Overrides
from simplifier.geometry.room import Room
from simplifier.geometry.solid import BoolArray, Solid
from simplifier.kernels.soup_views import all_contained
from simplifier.options.stages import SolidOptions
from simplifier.voxel.fill import fill
from simplifier.voxel.morphology import dilate

_NEAR = 3  # voxels; in a groove of a surface the nearest free one may be two away


def is_own_occluder(
    mesh: TriangleMesh, options: SolidOptions, budget: int, overrides: Overrides
) -> bool:
    """Whether the mesh may be its own occluder: within the budget, and allowed to touch itself.

    Not where a person decided what hides: the mesh may reach into open regions, and beside drawn
    parts its own triangles may be wasted.
    """
    free = not overrides.drawn and not overrides.open
    return free and len(mesh.faces) <= budget and not options.wholly_inside


def seen_triangles(mesh: TriangleMesh, solid: Solid) -> FloatArray:
    """(m, 3, 3) the mesh's triangles in world units, less those that are buried within others.

    A triangle is buried when the outside reaches no voxel within three of it: it could be seen
    only through openings that are narrower than two voxels.
    """
    triangles = mesh.vertices[mesh.faces]
    buried, margin = _buried_voxels(solid)
    hidden = np.zeros(len(triangles), dtype=np.bool_)
    all_contained(solid.touched.to_grid(triangles) + margin, Room.of(buried).voxels, hidden)
    return np.ascontiguousarray(triangles[~hidden])


def _buried_voxels(solid: Solid) -> tuple[BoolArray, float]:
    """The voxels that are not near free space, and the margin around the grid."""
    # What a remedy closed is seen all the same.
    free = ~np.pad(fill(solid.touched).inside, 1)
    near, margin = dilate(solid.touched.with_inside(free), _NEAR)
    return np.ascontiguousarray(~near), margin + 1.0
