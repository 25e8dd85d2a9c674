"""TriangleMesh -> Occluder: the paper's steps, in order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import numpy as np

from simplifier.affordable import (
    FEW_VIEWS,
    Work,
    affordable_views,
    fewer_directions,
    fits,
    quick,
)
from simplifier.deadline import Deadline
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
from simplifier.progress import Cancel, Listener, Stopwatch, Tell
from simplifier.selection.candidates import Candidates, score
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
    """An occluder, the solid that it was cut from, and what the user should know.

    ``interrupted``  whether the run was cancelled, so that this is the best so far.
    """

    occluder: Occluder
    solid: Solid
    warnings: tuple[str, ...]
    interrupted: bool = False


class _StoppedError(Exception):
    """Time is up or the run is cancelled, and there is already something to show."""


def simplify_mesh(
    mesh: TriangleMesh,
    options: Options,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
) -> Simplification:
    """Turn a triangle soup into an occluder of at most ``options.selection.budget`` triangles.

    ``listener`` is told about the progress; what it raises ends the run.  ``cancel``, once set,
    ends it soon: with the best so far from refining on, before that with
    :class:`~simplifier.errors.CancelledError`.  Raises
    :class:`~simplifier.errors.BackendUnavailableError` for a slicer that cannot run here.
    """
    deadline = Deadline.after(options.time_limit)
    watch = Stopwatch(listener, cancel)
    solid = solidify(mesh, options.solid, watch)
    warnings = _warnings(mesh, solid)  # before refining, which uses up what a time limit leaves
    vertices, faces = _start(mesh, solid, options, watch, deadline)
    with watch.stage("refine", cancels=False):
        vertices, faces = _refined(vertices, faces, mesh, solid, options, watch, deadline)
        interrupted = watch.cancelled
    occluder = Occluder(
        solid.filled.to_world(vertices), faces, ERROR_VOXELS * solid.filled.cell_size,
        dict(watch.timings),
    )  # fmt: skip
    if len(faces) == 0:
        warnings.append("no section is large enough to hide anything; raise --resolution")
    if interrupted:
        warnings.append("interrupted: the best so far")
    return Simplification(occluder, solid, tuple(warnings), interrupted)


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


def _start(
    mesh: TriangleMesh, solid: Solid, options: Options, watch: Stopwatch, deadline: Deadline
) -> tuple[FloatArray, IntArray]:
    """The cut; under a time limit a quick one, which is always ended, and a fuller one if it fits.

    Returns vertices in grid space and faces.
    """
    with _slicer(solid, options.sections, watch) as slicer:
        if not deadline.limited:
            return _cut_solid(mesh, solid, options, slicer, watch, deadline)
        small = quick(options)
        cut = _cut_solid(mesh, solid, small, slicer, watch, Deadline.after(None))
        fuller = _fullest(solid, options, small, watch.timings, deadline)
        if fuller is not None:
            with suppress(_StoppedError):
                cut = _cut_solid(mesh, solid, fuller, slicer, watch, deadline.part(0.5))
        return cut


def _fullest(
    solid: Solid, options: Options, small: Options, timings: Mapping[str, float], deadline: Deadline
) -> Options | None:
    """The most directions that time is left for, judged by the timings of a small start."""
    done = _work(solid, small)
    slicing = timings["sections"]
    choosing = timings["loops"] + timings["chains"] + timings["cut"]
    for fuller in fewer_directions(options):
        if fits(done, slicing, choosing, _work(solid, fuller), deadline.left):
            return fuller
    return None


def _work(solid: Solid, options: Options) -> Work:
    plan = plan_sections(solid.filled, options.sections)
    return Work(len(plan), plan.bins, options.selection.exchanges)


def _cut_solid(
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    slicer: Slicer,
    watch: Stopwatch,
    deadline: Deadline,
) -> tuple[FloatArray, IntArray]:
    """Sections to cut (sections 4.2 to 4.5); raises :class:`_StoppedError` at the deadline."""

    def steps(stage: str) -> Tell:
        tell = watch.steps(stage)

        def tell_in_time(share: float) -> None:
            if deadline.is_up:
                raise _StoppedError
            tell(share)

        return tell_in_time

    with watch.stage("sections"):
        plan = plan_sections(solid.filled, options.sections)
        sections = best_sections(plan, slicer, steps("sections"))
    with watch.stage("loops"):
        polygons = [edge_loops(section) for section in sections]
    with watch.stage("chains"):
        chains = _chains(sections, polygons, steps("chains"))
    with watch.stage("cut"):
        cut = _cut(chains, mesh, solid, options.selection, options.seed, steps("cut"))
    return _triangles(chains, cut)


@contextmanager
def _slicer(solid: Solid, options: SectionOptions, watch: Stopwatch) -> Iterator[Slicer]:
    if options.slicer == "cpu":
        yield GridSampler(solid.filled)
        return
    with watch.stage("surface"):
        vertices, faces = voxel_mesh(solid.filled)
    with StencilSlicer(vertices, faces, solid.filled.shape) as slicer:
        yield slicer


def _chains(
    sections: Sequence[Section], polygons: Sequence[Sequence[Polygon]], tell: Tell
) -> list[Chain]:
    chains: list[Chain] = []
    for index, (section, pieces) in enumerate(zip(sections, polygons, strict=True)):
        tell(index / len(sections))
        for polygon in pieces:
            simplified = simplify_polygon(polygon, TOLERANCE_VOXELS)
            if simplified is not None:
                chains.append(simplification_chain(bridge_holes(simplified), section.plane))
    return chains


def _cut(
    chains: Sequence[Chain],
    mesh: TriangleMesh,
    solid: Solid,
    options: SelectionOptions,
    seed: int,
    tell: Tell,
) -> Cut:
    projections = _search_views(mesh, solid, options.views)
    candidates = Candidates.from_chains(chains, projections)
    if options.trim == "area":
        return trim_by_area(candidates, greedy_cut(candidates, options.alpha), options.budget)
    room = seed % 2**62  # each search adds its number, and the kernel takes 64 bits
    return choose_by_gain(candidates, options.budget, options.alpha, options.exchanges, room, tell)


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
    deadline: Deadline,
) -> tuple[FloatArray, IntArray]:
    """Move the vertices within the solid dilated by a voxel, which keeps the error bound."""
    if options.refine.moves == 0 or len(faces) == 0:
        return vertices, faces
    try:
        allowed, margin = dilated(solid.filled)
        views = _views(mesh, solid, options.refine.views, margin, watch, deadline)
    except _StoppedError:
        return vertices, faces
    whole = max(score(views.originals), 1)

    def stop(share: float, best: int) -> bool:
        watch.tell("refine", share, max(best / whole, 0.0))
        return watch.cancelled

    moved, kept = refine(
        vertices + margin, faces, allowed, views, options.refine, options.seed, stop,
        deadline if deadline.limited else None,
    )  # fmt: skip
    return moved - margin, kept


def _views(
    mesh: TriangleMesh,
    solid: Solid,
    most: int,
    margin: float,
    watch: Stopwatch,
    deadline: Deadline,
) -> RefineViews:
    """The original as the search sees it, in fewer views where a time limit is short.

    Raises :class:`_StoppedError` when the time is up or the run cancelled before they are drawn.
    """

    def tell(share: float) -> None:
        if watch.cancelled or deadline.is_up:
            raise _StoppedError

    vertices = solid.filled.to_grid(mesh.vertices) + margin

    def drawn(count: int) -> RefineViews:
        projections = _search_views(mesh, solid, count, margin)
        return RefineViews(projections, silhouettes(vertices, mesh.faces, projections, tell))

    tell(0.0)
    if not deadline.limited:
        return drawn(most)
    before = deadline.left
    few = drawn(min(FEW_VIEWS, most))
    count = len(few.projections)
    more = affordable_views(most, count, before - deadline.left, deadline.left)
    return drawn(more) if more > count else few


def _search_views(mesh: TriangleMesh, solid: Solid, count: int, margin: float = 0.0) -> FloatArray:
    """(count, 2, 4) maps from grid space, shifted by ``margin``, to the search's pictures."""
    sphere = BoundingSphere.of(mesh)
    return search_projections(
        image_axes(hemisphere_directions(count)),
        solid.filled.to_grid(sphere.centre) + margin,
        sphere.radius / solid.filled.cell_size,
    )


def _warnings(mesh: TriangleMesh, solid: Solid) -> list[str]:
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
    return warnings
