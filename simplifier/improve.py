"""Triangles -> triangles: refinement within the solid, by pictures of the original."""

from __future__ import annotations

from contextlib import suppress

from simplifier.affordable import FEW_VIEWS, affordable_views
from simplifier.deadline import Deadline
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.solid import Solid
from simplifier.options import Options
from simplifier.progress import Stopwatch
from simplifier.selection.annealing import RefineViews
from simplifier.selection.measure import silhouettes
from simplifier.selection.refine import pulled_in, refine
from simplifier.selection.thin import thinned
from simplifier.sight import search_projections
from simplifier.voxel.morphology import dilated


class _StoppedError(Exception):
    """Time is up or the run is cancelled before there is a picture to refine by."""


def improve(
    start: FloatArray,
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
) -> FloatArray:
    """Move the triangles (m, 3, 3) of grid space within the core and its reach.

    That keeps the error bound.  Triangles that are not to leave the core at all are pulled in even
    when there is nothing to refine.
    """
    if len(start) == 0 or (options.refine.moves == 0 and solid.reach > 0):
        return start
    allowed, margin = dilated(solid.core, solid.reach)
    inside = pulled_in(start + margin, allowed) if solid.reach == 0 else start + margin
    if options.refine.moves == 0:
        return inside - margin
    try:
        views = _views(mesh, solid, options, margin, watch, deadline)
    except _StoppedError:
        return inside - margin

    def stop(share: float, measure: float) -> bool:
        watch.tell("refine", share, measure)
        return watch.cancelled

    return -margin + refine(
        [inside], allowed, views, options.selection.budget, options.refine, options.seed, stop,
        deadline if deadline.limited else None,
    )  # fmt: skip


def _views(
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    margin: float,
    watch: Stopwatch,
    deadline: Deadline,
) -> RefineViews:
    """The original as the search sees it, in fewer views where a time limit is short."""

    def tell(share: float) -> None:
        if watch.cancelled or deadline.is_up:
            raise _StoppedError

    tell(0.0)
    vertices, faces = thinned(solid.core.to_grid(mesh.vertices) + margin, mesh.faces)

    def drawn(count: int) -> RefineViews:
        tell(0.0)
        projections = search_projections(solid, options, count, margin)
        drawing = deadline.rest()

        def keep_pace(share: float) -> None:
            tell(share)
            if share < 0.5 < drawing.share:  # so slow that nothing would be left for refining
                raise _StoppedError

        return RefineViews(projections, silhouettes(vertices, faces, projections, keep_pace))

    most = options.refine.views
    if not deadline.limited:
        return drawn(most)
    before = deadline.left
    few = drawn(min(FEW_VIEWS, most))
    count = len(few.projections)
    more = affordable_views(most, count, before - deadline.left, deadline.left)
    if more > count:
        with suppress(_StoppedError):
            return drawn(more)
    return few
