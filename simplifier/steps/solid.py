"""TriangleMesh -> Solid: what is inside (section 4.1), and what the user should know of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.mesh import FloatArray, Reach, TriangleMesh
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import Closing, Solid
from simplifier.kernels.thin import border_places
from simplifier.options.stages import SolidOptions
from simplifier.progress import Stopwatch
from simplifier.steps.largest import may_lend
from simplifier.voxel.core import barred_voxels, core, deepest, open_regions
from simplifier.voxel.fill import Side, enclose
from simplifier.voxel.leaks import leak_warning, leaks
from simplifier.voxel.morphology import glue_neighbours
from simplifier.voxel.sight import fill_unseen, seen_from
from simplifier.voxel.voxelize import voxelize_finely
from simplifier.wording import count, length, percent

_EYES = 256  # that stand for all who walk indoors


def solidify(
    mesh: TriangleMesh,
    options: SolidOptions,
    watch: Stopwatch,
    overrides: Overrides = NO_OVERRIDES,
    size: int = 1,
) -> Solid:
    """The voxels that the mesh touches, what they enclose, and what of it is to be hidden in.

    The core is without the open regions, the filled solid is with them: the mesh is what it is.

    ``size``  voxels of the room to a cell of the solid along each axis: where they are more than
    one, triangles are marked in those alone, and kept until there is a room.
    """
    regions = [one.region for one in overrides.open]
    with watch.stage("voxelize"):
        touched, finer = voxelize_finely(mesh, options.resolution, size)
        if options.glue and not options.wholly_inside:
            touched = glue_neighbours(touched)
    with watch.stage("fill"):
        sides = _sides_on_ground(options)
        filled, closed_by = enclose(touched, sides, touched.in_voxels(options.smallest_hole))
        is_open = options.wholly_inside and options.by_sight and not is_closed(mesh)
        if options.by_sight and (is_open or not options.wholly_inside):
            enclosed = filled
            up = "xyz".index(options.up) if options.viewers == "above" else None
            filled = fill_unseen(touched, enclosed, options.tolerance, up, watch.steps("fill"))
            if (added := filled.count - enclosed.count) > 0:
                closed_by = (*closed_by, Closing("sight", added))
        eyes, opened = touched.to_grid(_eyes(mesh, options, overrides)), 0
        if len(eyes) > 0:
            free = (filled.bits - touched.bits).voxels
            seen = BitGrid.of(seen_from(touched.inside, free, eyes))
            filled, opened = filled.with_inside(filled.bits - seen), seen.count
        if not options.wholly_inside:
            hidden_in, reach = open_regions(filled, regions), 0 if options.glue else 1
            return Solid(
                touched, filled, hidden_in, reach, closed_by, opened=opened,
                finer=finer if size > 1 else None,
            )  # fmt: skip
        shrink, lowest = touched.in_voxels(options.shrink), touched.to_grid(mesh.bounds[0])
        inner = open_regions(core(touched, filled, shrink, lowest, sides), regions)
        return Solid(
            touched, filled, inner, 0, closed_by, wholly_inside=True, open=is_open, opened=opened
        )


def _eyes(mesh: TriangleMesh, options: SolidOptions, overrides: Overrides) -> FloatArray:
    """(n, 3) world units: the places that overrides name, and some of those to walk indoors."""
    if options.viewers != "inside":
        return overrides.viewers
    # Here, not above: scipy's graphs take a tenth of a second to load, and most runs need none.
    from simplifier.camera_paths.columns import UprightScene
    from simplifier.camera_paths.interior import places_indoors

    indoors = places_indoors(UprightScene.of(Scene.of(mesh), options.up), options.eye_height)
    return np.concatenate([overrides.viewers, _spread(indoors)])


def _spread(places: FloatArray) -> FloatArray:
    """At most :data:`_EYES` of the places (n, 3), one in each cube of the least size that does."""
    size, found = 0.0, places
    while len(found) > _EYES:
        size = max(1.25 * size, 0.01 * float(np.ptp(places, axis=0).max()))
        cubes = np.floor((places - places.min(axis=0)) / size).astype(np.int64)
        _, first = np.unique(cubes, axis=0, return_index=True)
        found = places[np.sort(first)]
    return found


def solid_warnings(
    mesh: TriangleMesh, solid: Solid, options: SolidOptions, overrides: Overrides = NO_OVERRIDES
) -> list[str]:
    """What was left out of the mesh, where it is open, and why there may be nothing to cut."""
    warnings = []
    dropped = mesh.dropped
    if dropped.total:
        noun = "triangle of the input was" if dropped.total == 1 else "triangles of the input were"
        warnings.append(f"{dropped.total} unusable {noun} left out: {dropped}; check the export")
    if mesh.usual_reach < solid.touched.cell_size:
        warnings.append(_stretched_warning(mesh, solid))
    if options.viewers == "inside" and solid.opened == 0:
        warnings.append(
            f"viewers inside, with eyes {options.eye_height:g} units above a floor, see no more"
            " than viewers outside; check the up axis, the eye height, and that a way leads in"
        )
    if solid.opened == 0 and leaks(solid.touched, solid.filled):
        hole = solid.touched.in_voxels(options.smallest_hole)
        warnings.append(leak_warning(solid.touched, solid.filled, _sides_on_ground(options), hole))
    if solid.core.count == 0:
        warnings.append(_empty_warning(solid, options, overrides))
    return warnings


def solid_decisions(solid: Solid, options: SolidOptions) -> list[str]:
    """How fine the solid is, and what counts as inside, a sentence each."""
    filled, cells = solid.filled, max(solid.filled.shape)
    lines = [
        f"The longest edge of the mesh is cut into {count(cells, 'voxel')} of"
        f" {length(filled.cell_size)} units each."
    ]
    for closing in solid.closed_by:
        cause = _CLOSED_BY[closing.by].format(percent(options.tolerance, 0))
        share = percent(closing.voxels / (filled.count + solid.opened))
        lines.append(f"{share} of the solid counts as inside because {cause}.")
    if not solid.closed_by:
        lines.append(
            f"The surface itself encloses {percent(solid.enclosed_fraction)} of the solid."
        )
    if solid.opened > 0:
        share = percent(solid.opened / (filled.count + solid.opened))
        lines.append(f"{share} of that stays open because viewers inside see it.")
    if solid.wholly_inside:
        lines.append(
            "Only what lies wholly inside may hide; the mesh is open, so it is drawn in where it"
            " could be seen past an edge."
            if solid.open
            else "Only what lies wholly inside may hide."
        )
    return lines


_CLOSED_BY = {
    "ground": "the ground closes the mesh from below",
    "smallest_hole": "openings narrower than the smallest hole are closed",
    "sight": "viewers see it from at most {} of all directions",
}


def _stretched_warning(mesh: TriangleMesh, solid: Solid) -> str:
    """That a few far triangles leave nearly no voxels for the others."""
    reach = Reach.measure(mesh.vertices, mesh.faces)
    corners = mesh.vertices[mesh.faces[reach.of.argmax()]]
    furthest = corners[np.abs(corners - reach.middle).max(axis=1).argmax()]
    return (
        f"half of the triangles lie within one voxel of {_point(reach.middle)}, because others"
        f" reach out to {_point(furthest)}; the occluder hides almost nothing of that half; repair"
        " that vertex, or simplify the two parts separately"
    )


def _point(coordinates: FloatArray) -> str:
    return f"({', '.join(f'{value:.6g}' for value in coordinates)})"


def _empty_warning(solid: Solid, options: SolidOptions, overrides: Overrides) -> str:
    """Why nothing is found to hide behind, and what would help."""
    regions = [one.region for one in overrides.open]
    if regions and barred_voxels(solid.filled, regions)[solid.filled.inside].all():
        return "open regions take up all of the mesh, so nothing is left to hide behind"
    if options.shrink == 0.0:
        itself = may_lend(options, overrides)
        effect = "only triangles of the mesh itself hide" if itself else "the occluder is empty"
        return (
            f"no voxel lies wholly inside, so {effect}; raise the resolution or, if the mesh"
            " encloses nothing, allow some overhang"
        )
    depth = deepest(solid.touched, solid.filled, _sides_on_ground(options)) * solid.core.cell_size
    smaller = f"choose at most {depth:.3g}" if depth > 0.0 else "leave it out"
    return (
        f"no voxel is as deep inside as shrink {options.shrink:g}, so the occluder is empty; "
        f"{smaller}, or raise the resolution"
    )


def _sides_on_ground(options: SolidOptions) -> frozenset[Side]:
    return frozenset({("xyz".index(options.up), 0)} if options.ground else ())


_ROUNDING = 1e-9
"""Of the longest edge: what a seam may gape, far less than 32-bit coordinates tell apart."""


def is_closed(mesh: TriangleMesh) -> bool:
    """Whether every edge of the mesh has another face, vertices at one place being one."""
    if not border_places(mesh.faces, len(mesh.vertices)).any():
        return True
    gap = _ROUNDING * float(mesh.extent.max())
    places = np.zeros(len(mesh.vertices), dtype=np.int64)
    for column in mesh.vertices.T:
        numbers = _numbered(column, gap)
        _, places = np.unique(places * (numbers.max() + 1) + numbers, return_inverse=True)
    return not border_places(places.astype(np.int32)[mesh.faces], len(places)).any()


def _numbered(values: NDArray[np.float64], gap: float) -> NDArray[np.int64]:
    """The same number for values that lie within a gap of each other, or of those between them."""
    order = np.argsort(values)
    numbers = np.empty(len(values), dtype=np.int64)
    numbers[order[0]] = 0
    numbers[order[1:]] = np.cumsum(np.diff(values[order]) > gap)
    return numbers
