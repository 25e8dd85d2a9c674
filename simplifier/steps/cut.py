"""Solid -> triangles: the paper's sections and cut (sections 4.2 to 4.5), in order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

import numpy as np

from simplifier.geometry.mesh import FloatArray, as_mesh
from simplifier.geometry.overrides import NOTHING
from simplifier.geometry.section import Chain, Polygon, Section
from simplifier.geometry.solid import Solid
from simplifier.options.stages import TOLERANCE_VOXELS, Options, SectionOptions
from simplifier.polygon.chain import simplification_chain, triangulate
from simplifier.polygon.simplify import bridge_holes, simplify_polygon
from simplifier.progress import Deadline, Stopwatch, TellShare
from simplifier.selection.candidates import Candidates
from simplifier.selection.exchange import choose_by_gain
from simplifier.selection.greedy import Cut, greedy_cut, trim_by_area
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.slicing.loops import edge_loops
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import Slicer, best_sections
from simplifier.slicing.stencil import StencilSlicer
from simplifier.steps.time_limit import StartCost, fewer_directions, leaves_time_for, quick
from simplifier.voxel.surface import voxel_mesh


class _TimeUpError(Exception):
    """The deadline has come, and there is already something to show."""


def cut_solid(
    solid: Solid,
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
    drawn: FloatArray = NOTHING,
) -> FloatArray:
    """(m, 3, 3) triangles in grid space, m within the budget, that add to what is ``drawn``.

    Under a time limit a quick cut, which is always ended, and a fuller one if it fits.
    """
    with _slicer(solid, options.sections, watch) as slicer:
        if not deadline.limited:
            return _cut_by(slicer, solid, options, watch, deadline, drawn)
        small = quick(options)
        found = _cut_by(slicer, solid, small, watch, Deadline.after(None), drawn)
        fuller = _fullest_affordable(solid, options, small, watch.timings, deadline)
        if fuller is not None:
            with suppress(_TimeUpError):
                found = _cut_by(slicer, solid, fuller, watch, deadline.part(0.5), drawn)
        return found


def _fullest_affordable(
    solid: Solid, options: Options, small: Options, timings: Mapping[str, float], deadline: Deadline
) -> Options | None:
    """The most directions that time is left for, judged by the timings of a small start."""
    done = _cost_of(solid, small)
    slicing = timings["sections"]
    choosing = timings["loops"] + timings["chains"] + timings["cut"]
    for fuller in fewer_directions(options):
        if leaves_time_for(done, slicing, choosing, _cost_of(solid, fuller), deadline.left):
            return fuller
    return None


def _cost_of(solid: Solid, options: Options) -> StartCost:
    plan = plan_sections(solid.core, options.sections)
    return StartCost(len(plan), plan.bins, options.selection.exchanges)


def _cut_by(
    slicer: Slicer,
    solid: Solid,
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
    drawn: FloatArray,
) -> FloatArray:
    """Raises :class:`_TimeUpError` at the deadline."""

    def steps(stage: str) -> TellShare:
        tell = watch.steps(stage)

        def tell_in_time(share: float) -> None:
            if deadline.is_up:
                raise _TimeUpError
            tell(share)

        return tell_in_time

    with watch.stage("sections"):
        plan = plan_sections(solid.core, options.sections)
        sections = best_sections(plan, slicer, steps("sections"))
    with watch.stage("loops"):
        polygons = [edge_loops(section) for section in sections]
    with watch.stage("chains"):
        chains = _chains(sections, polygons, steps("chains"))
    with watch.stage("cut"):
        return _triangles(chains, _cut(chains, solid, options, drawn, steps("cut")))


@contextmanager
def _slicer(solid: Solid, options: SectionOptions, watch: Stopwatch) -> Iterator[Slicer]:
    if options.slicer == "cpu":
        yield GridSampler(solid.core)
        return
    with watch.stage("surface"):
        vertices, faces = voxel_mesh(solid.core)
    with StencilSlicer(vertices, faces, solid.core.shape) as slicer:
        yield slicer


def _chains(
    sections: Sequence[Section], polygons: Sequence[Sequence[Polygon]], tell: TellShare
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
    chains: Sequence[Chain], solid: Solid, options: Options, drawn: FloatArray, tell: TellShare
) -> Cut:
    chosen = options.selection
    projections = search_projections(solid, options, chosen.views)
    standing = silhouettes(*as_mesh(drawn), projections)
    candidates = Candidates.from_chains(chains, projections, standing)
    if chosen.trim == "area":
        return trim_by_area(candidates, greedy_cut(candidates, chosen.alpha), chosen.budget)
    room = options.seed % 2**62  # each search adds its number, and the kernel takes 64 bits
    return choose_by_gain(candidates, chosen.budget, chosen.alpha, chosen.exchanges, room, tell)


def _triangles(chains: Sequence[Chain], cut: Cut) -> FloatArray:
    """The polygons that the cut names, (m, 3, 3) in grid space."""
    triangles = [NOTHING]
    for chain, level in zip(chains, cut, strict=True):
        if level > 0:
            ring = chain.at(int(level))
            triangles.append(chain.plane.to_space(ring)[triangulate(ring)])
    return np.concatenate(triangles)
