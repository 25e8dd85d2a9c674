"""Triangles of the mesh itself: what has no more than the budget is its own best occluder.

It hides exactly what the original hides and strays from it nowhere.  Pictures could only spoil it:
a needle is thinner than any pixel, and a search that cannot see it finds nothing, or too much.

The same is so of a mesh whose flat parts need no more once each is cut into as few as cover it.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.overrides import Overrides
from simplifier.geometry.room import Room
from simplifier.geometry.solid import BoolArray, Solid
from simplifier.options.stages import SolidOptions
from simplifier.polygon.coplanar import group_by_plane, merge_coplanar
from simplifier.refinement.containment import are_inside
from simplifier.steps.largest import may_lend
from simplifier.voxel.fill import fill
from simplifier.voxel.morphology import dilate

_NEAR = 3  # voxels; in a groove of a surface the nearest free one may be two away
_FLAT = 1e-5  # of the longest edge: a hundredth of a pixel, and more than 32-bit numbers are off
_MOST_PLANES = 256
_SAMPLE = 2  # triangles a plane, by which nearly all meshes are told that have too many
_MOST_COMPARED = 2_000_000  # triangles with planes, about a tenth of a second


def is_own_occluder(
    mesh: TriangleMesh, options: SolidOptions, budget: int, overrides: Overrides
) -> bool:
    """Whether the mesh may be its own occluder: within the budget, and allowed to touch itself."""
    return len(mesh.faces) <= budget and _may_touch_itself(options, overrides)


def _may_touch_itself(options: SolidOptions, overrides: Overrides) -> bool:
    """Not where a person decided what hides: the mesh may reach into open regions, and beside drawn
    parts its own triangles may be wasted."""
    return not options.wholly_inside and may_lend(options, overrides)


def own_triangles(
    mesh: TriangleMesh, solid: Solid, options: SolidOptions, budget: int, overrides: Overrides
) -> tuple[FloatArray, str] | None:
    """(m, 3, 3) triangles in world units, m at most the budget, that cover what of the mesh is
    seen, and a sentence on them; None where it takes more, or the mesh may not touch itself.

    They are its own, or fewer that stray from it by a fifty-thousandth of its longest edge at most.
    """
    if not _may_touch_itself(options, overrides):
        return None
    # Gaps between objects are to be closed, which what covers these alone does not do.
    flat = not options.glue and _has_few_planes(mesh, solid, budget)
    if not flat and len(mesh.faces) > budget:
        return None
    seen = seen_triangles(mesh, solid)
    merged = _merged(seen, solid, budget) if flat else None
    if merged is not None and len(merged) < len(seen):
        return merged, "Its flat parts take no more triangles than the budget, so they are kept."
    if len(seen) <= budget:
        return seen, "The mesh has no more triangles than the budget, so it is its own occluder."
    return None


def _has_few_planes(mesh: TriangleMesh, solid: Solid, budget: int) -> bool:
    """Whether some of its triangles lie in so few planes, which tells most meshes at once."""
    most = min(budget, _MOST_PLANES)
    sample = mesh.faces[:: max(len(mesh.faces) // (_SAMPLE * most), 1)]
    placed = solid.touched.to_grid(mesh.vertices[sample])
    groups = group_by_plane(placed, _tolerance(solid), most)
    return groups is not None and len(groups) * len(mesh.faces) <= _MOST_COMPARED


def _merged(triangles: FloatArray, solid: Solid, budget: int) -> FloatArray | None:
    """(m, 3, 3) in world units; None where it takes more, or each plane has two at most."""
    placed, tolerance = solid.touched.to_grid(triangles), _tolerance(solid)
    groups = group_by_plane(placed, tolerance, min(budget, _MOST_PLANES))
    if groups is None or all(len(group.which) <= 2 for group in groups):
        return None
    found = merge_coplanar(placed, groups, tolerance, budget)
    return None if found is None else solid.touched.to_world(found)


def _tolerance(solid: Solid) -> float:
    """In voxels."""
    return _FLAT * max(solid.touched.shape)


def seen_triangles(mesh: TriangleMesh, solid: Solid) -> FloatArray:
    """(m, 3, 3) the mesh's triangles in world units, less those that are buried within others.

    A triangle is buried when the outside reaches no voxel within three of it: it could be seen
    only through openings that are narrower than two voxels.
    """
    triangles = mesh.vertices[mesh.faces]
    buried, margin = _buried_voxels(solid)
    hidden = are_inside(solid.touched.to_grid(triangles) + margin, Room.of(buried))
    return np.ascontiguousarray(triangles[~hidden])


def _buried_voxels(solid: Solid) -> tuple[BoolArray, float]:
    """The voxels that are not near free space, and the margin around the grid."""
    # What a remedy closed is seen all the same.
    free = ~np.pad(fill(solid.touched).inside, 1)
    near, margin = dilate(solid.touched.with_inside(free), _NEAR)
    return np.ascontiguousarray(~near), margin + 1.0
