"""TriangleMesh -> Occluder: the paper's steps, in order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.polygon import Chain, Polygon
from simplifier.geometry.section import Section
from simplifier.geometry.solid import Solid
from simplifier.geometry.views import (
    BoundingSphere,
    from_above,
    hemisphere_directions,
    image_axes,
)
from simplifier.options import (
    ERROR_VOXELS,
    TOLERANCE_VOXELS,
    Options,
    SectionOptions,
    SolidOptions,
)
from simplifier.polygon.bridge import bridge_holes
from simplifier.polygon.chain import simplification_chain
from simplifier.polygon.simplify import simplify_polygon
from simplifier.polygon.triangulate import triangulate
from simplifier.progress import Listener, Stopwatch
from simplifier.selection.candidates import Candidates
from simplifier.selection.exchange import choose_by_gain
from simplifier.selection.greedy import Cut, greedy_cut
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.selection.refine import RefineViews, refine
from simplifier.selection.trim import trim_by_area
from simplifier.slicing.loops import edge_loops
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import Slicer, best_sections
from simplifier.slicing.stencil import StencilSlicer
from simplifier.voxel.core import core, deepest
from simplifier.voxel.enclose import enclose
from simplifier.voxel.fill import Side
from simplifier.voxel.leaks import leaks
from simplifier.voxel.morphology import dilated
from simplifier.voxel.remedies import leak_warning
from simplifier.voxel.surface import voxel_mesh
from simplifier.voxel.voxelize import voxelize


@dataclass(frozen=True, eq=False)
class Simplification:
    """An occluder, the solid that it was cut from, and what the user should know."""

    occluder: Occluder
    solid: Solid
    warnings: tuple[str, ...]


def simplify_mesh(
    mesh: TriangleMesh, options: Options, listener: Listener | None = None
) -> Simplification:
    """Turn a triangle soup into an occluder of at most ``options.selection.budget`` triangles.

    ``listener`` is told about stages as they begin and end; what it raises ends the run.
    Raises :class:`~simplifier.errors.BackendUnavailableError` for a slicer that cannot run here.
    """
    watch = Stopwatch(listener)
    solid = solidify(mesh, options.solid, watch)
    sections = _sections(solid, options.sections, watch)
    with watch.stage("loops"):
        polygons = [edge_loops(section) for section in sections]
    with watch.stage("chains"):
        chains = _chains(sections, polygons)
    with watch.stage("cut"):
        cut = _cut(chains, mesh, solid, options)
    vertices, faces = _triangles(chains, cut)
    with watch.stage("refine"):
        vertices, faces = _refined(vertices, faces, mesh, solid, options, watch)
    # A voxel of a core that is not to be left is interior, at no distance at all.
    bound = ERROR_VOXELS * solid.core.cell_size if solid.reach > 0 else 0.0
    occluder = Occluder(solid.core.to_world(vertices), faces, bound, dict(watch.timings))
    return Simplification(occluder, solid, _warnings(mesh, solid, occluder, options.solid))


def solidify(mesh: TriangleMesh, options: SolidOptions, watch: Stopwatch) -> Solid:
    """Decide what is inside (section 4.1): the touched voxels and what they enclose."""
    with watch.stage("voxelize"):
        touched = voxelize(mesh, options.resolution)
    with watch.stage("fill"):
        sides = _closed_sides(options)
        filled, closed_by = enclose(touched, sides, touched.in_voxels(options.smallest_hole))
        if not options.wholly_inside:
            return Solid(touched, filled, filled, 1, closed_by)
        shrink, lowest = touched.in_voxels(options.shrink), touched.to_grid(mesh.bounds[0])
        inner = core(touched, filled, shrink, lowest, sides)
        return Solid(touched, filled, inner, 0, closed_by)


def _closed_sides(options: SolidOptions) -> frozenset[Side]:
    return frozenset({("xyz".index(options.up), 0)} if options.ground else ())


def _sections(solid: Solid, options: SectionOptions, watch: Stopwatch) -> list[Section]:
    plan = plan_sections(solid.core, options)
    with _slicer(solid, options, watch) as slicer, watch.stage("sections"):
        return best_sections(plan, slicer)


@contextmanager
def _slicer(solid: Solid, options: SectionOptions, watch: Stopwatch) -> Iterator[Slicer]:
    if options.slicer == "cpu":
        yield GridSampler(solid.core)
        return
    with watch.stage("surface"):
        vertices, faces = voxel_mesh(solid.core)
    with StencilSlicer(vertices, faces, solid.core.shape) as slicer:
        yield slicer


def _chains(sections: Sequence[Section], polygons: Sequence[Sequence[Polygon]]) -> list[Chain]:
    chains = []
    for section, pieces in zip(sections, polygons, strict=True):
        for polygon in pieces:
            simplified = simplify_polygon(polygon, TOLERANCE_VOXELS)
            if simplified is not None:
                chains.append(simplification_chain(bridge_holes(simplified), section.plane))
    return chains


def _cut(chains: Sequence[Chain], mesh: TriangleMesh, solid: Solid, options: Options) -> Cut:
    chosen = options.selection
    projections = _search_views(mesh, solid, options, chosen.views)
    candidates = Candidates.from_chains(chains, projections)
    if chosen.trim == "area":
        return trim_by_area(candidates, greedy_cut(candidates, chosen.alpha), chosen.budget)
    room = options.seed % 2**62  # each search adds its number, and the kernel takes 64 bits
    return choose_by_gain(candidates, chosen.budget, chosen.alpha, chosen.exchanges, room)


def _triangles(chains: Sequence[Chain], cut: Cut) -> tuple[FloatArray, IntArray]:
    """Vertices in grid space and faces of the polygons that the cut names."""
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), np.int32)], 0
    for chain, level in zip(chains, cut, strict=True):
        if level == 0:
            continue
        ring = chain.at(int(level))
        vertices.append(chain.plane.to_space(ring))
        faces.append(triangulate(ring) + np.int32(count))
        count += len(ring)
    return np.concatenate(vertices), np.ascontiguousarray(np.concatenate(faces), dtype=np.int32)


def _refined(
    vertices: FloatArray,
    faces: IntArray,
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    watch: Stopwatch,
) -> tuple[FloatArray, IntArray]:
    """Move the vertices within the core and its reach, which keeps the error bound."""
    if len(faces) == 0 or (options.refine.moves == 0 and solid.reach > 0):
        return vertices, faces
    allowed, margin = dilated(solid.core, solid.reach)
    projections = _search_views(mesh, solid, options, options.refine.views, margin)
    originals = silhouettes(solid.core.to_grid(mesh.vertices) + margin, mesh.faces, projections)

    def tell(share: float) -> bool:
        watch.tell("refine", share)
        return False

    moved, kept = refine(
        vertices + margin, faces, allowed, RefineViews(projections, originals), options.refine,
        options.seed, tell,
    )  # fmt: skip
    return moved - margin, kept


def _search_views(
    mesh: TriangleMesh, solid: Solid, options: Options, count: int, margin: float = 0.0
) -> FloatArray:
    """(count, 2, 4) maps from grid space, shifted by ``margin``, to the search's pictures."""
    sphere = BoundingSphere.of(mesh)
    directions = hemisphere_directions(count)
    if options.viewers == "above":
        directions = from_above(directions, "xyz".index(options.solid.up))
    return search_projections(
        image_axes(directions),
        solid.core.to_grid(sphere.centre) + margin,
        sphere.radius / solid.core.cell_size,
    )


def _warnings(
    mesh: TriangleMesh, solid: Solid, occluder: Occluder, options: SolidOptions
) -> tuple[str, ...]:
    warnings = []
    dropped = mesh.dropped.total
    if dropped:
        noun = "triangle of the input was" if dropped == 1 else "triangles of the input were"
        warnings.append(f"{dropped} unusable {noun} left out")
    if leaks(solid.touched, solid.filled):
        hole = solid.touched.in_voxels(options.smallest_hole)
        warnings.append(leak_warning(solid.touched, solid.filled, _closed_sides(options), hole))
    if solid.core.count == 0:
        warnings.append(_empty_warning(solid, options))
    elif len(occluder.faces) == 0:
        warnings.append("no section is large enough to hide anything; raise --resolution")
    return tuple(warnings)


def _empty_warning(solid: Solid, options: SolidOptions) -> str:
    """Why the occluder has no triangle, and what would give it some."""
    if options.shrink == 0.0:
        return "no voxel lies wholly inside, so the occluder is empty; raise --resolution"
    depth = deepest(solid.touched, solid.filled, _closed_sides(options)) * solid.core.cell_size
    smaller = f"choose at most {depth:.3g}" if depth > 0.0 else "leave it out"
    return (
        f"no voxel is as deep inside as --shrink {options.shrink:g}, so the occluder is empty; "
        f"{smaller}, or raise --resolution"
    )
