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
from simplifier.geometry.solid import Closing, Solid
from simplifier.geometry.views import BoundingSphere, hemisphere_directions, image_axes
from simplifier.options import (
    ERROR_VOXELS,
    TOLERANCE_VOXELS,
    Options,
    SectionOptions,
    SelectionOptions,
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
from simplifier.voxel.fill import Side, fill
from simplifier.voxel.leaks import leaks
from simplifier.voxel.morphology import dilated
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
        cut = _cut(chains, mesh, solid, options.selection, options.seed)
    vertices, faces = _triangles(chains, cut)
    with watch.stage("refine"):
        vertices, faces = _refined(vertices, faces, mesh, solid, options, watch)
    occluder = Occluder(
        solid.filled.to_world(vertices), faces, ERROR_VOXELS * solid.filled.cell_size,
        dict(watch.timings),
    )  # fmt: skip
    return Simplification(occluder, solid, _warnings(mesh, solid, occluder))


def solidify(mesh: TriangleMesh, options: SolidOptions, watch: Stopwatch) -> Solid:
    """Decide what is inside (section 4.1): the touched voxels and what they enclose."""
    with watch.stage("voxelize"):
        touched = voxelize(mesh, options.resolution)
    with watch.stage("fill"):
        filled = fill(touched)
        if not options.ground:
            return Solid(touched, filled)
        ground: Side = ("xyz".index(options.up), 0)
        grounded = fill(touched, frozenset({ground}))
        return Solid(touched, grounded, (Closing("ground", grounded.count - filled.count),))


def _sections(solid: Solid, options: SectionOptions, watch: Stopwatch) -> list[Section]:
    plan = plan_sections(solid.filled, options)
    with _slicer(solid, options, watch) as slicer, watch.stage("sections"):
        return best_sections(plan, slicer)


@contextmanager
def _slicer(solid: Solid, options: SectionOptions, watch: Stopwatch) -> Iterator[Slicer]:
    if options.slicer == "cpu":
        yield GridSampler(solid.filled)
        return
    with watch.stage("surface"):
        vertices, faces = voxel_mesh(solid.filled)
    with StencilSlicer(vertices, faces, solid.filled.shape) as slicer:
        yield slicer


def _chains(sections: Sequence[Section], polygons: Sequence[Sequence[Polygon]]) -> list[Chain]:
    chains = []
    for section, pieces in zip(sections, polygons, strict=True):
        for polygon in pieces:
            simplified = simplify_polygon(polygon, TOLERANCE_VOXELS)
            if simplified is not None:
                chains.append(simplification_chain(bridge_holes(simplified), section.plane))
    return chains


def _cut(
    chains: Sequence[Chain], mesh: TriangleMesh, solid: Solid, options: SelectionOptions, seed: int
) -> Cut:
    projections = _search_views(mesh, solid, options.views)
    candidates = Candidates.from_chains(chains, projections)
    if options.trim == "area":
        return trim_by_area(candidates, greedy_cut(candidates, options.alpha), options.budget)
    room = seed % 2**62  # each search adds its number, and the kernel takes 64 bits
    return choose_by_gain(candidates, options.budget, options.alpha, options.exchanges, room)


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
    """Move the vertices within the solid dilated by a voxel, which keeps the error bound."""
    if options.refine.moves == 0 or len(faces) == 0:
        return vertices, faces
    allowed, margin = dilated(solid.filled)
    projections = _search_views(mesh, solid, options.refine.views, margin)
    originals = silhouettes(solid.filled.to_grid(mesh.vertices) + margin, mesh.faces, projections)

    def tell(share: float, score: int) -> bool:
        watch.tell("refine", share)
        return False

    moved, kept = refine(
        vertices + margin, faces, allowed, RefineViews(projections, originals), options.refine,
        options.seed, tell,
    )  # fmt: skip
    return moved - margin, kept


def _search_views(mesh: TriangleMesh, solid: Solid, count: int, margin: float = 0.0) -> FloatArray:
    """(count, 2, 4) maps from grid space, shifted by ``margin``, to the search's pictures."""
    sphere = BoundingSphere.of(mesh)
    return search_projections(
        image_axes(hemisphere_directions(count)),
        solid.filled.to_grid(sphere.centre) + margin,
        sphere.radius / solid.filled.cell_size,
    )


def _warnings(mesh: TriangleMesh, solid: Solid, occluder: Occluder) -> tuple[str, ...]:
    warnings = []
    dropped = mesh.dropped.total
    if dropped:
        noun = "triangle of the input was" if dropped == 1 else "triangles of the input were"
        warnings.append(f"{dropped} unusable {noun} left out")
    if leaks(solid.touched, solid.filled):
        warnings.append(
            "the surface is open at this resolution, so almost nothing is inside; if the asset "
            "stands on the ground try --ground, else a lower --resolution"
        )
    if len(occluder.faces) == 0:
        warnings.append("no section is large enough to hide anything; raise --resolution")
    return tuple(warnings)
