"""The steps from a solid to the paper's occluder (sections 4.2 to 4.5), each timed as a stage."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from simplifier.device.choice import open_device
from simplifier.geometry.mesh import FloatArray, as_mesh
from simplifier.geometry.overrides import NOTHING
from simplifier.geometry.section import Chain, Polygon, Section
from simplifier.geometry.solid import Solid
from simplifier.options.stages import TOLERANCE_VOXELS, Options, SectionOptions
from simplifier.polygon.chain import simplification_chain, triangulate
from simplifier.polygon.simplify import bridge_holes, simplify_polygon
from simplifier.progress import Stopwatch, TellShare
from simplifier.selection.candidates import Candidates
from simplifier.selection.exchange import choose_by_gain
from simplifier.selection.greedy import Cut, greedy_cut, trim_by_area
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.slicing.loops import edge_loops
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import Slicer, best_sections
from simplifier.slicing.stencil import StencilSlicer
from simplifier.voxel.surface import voxel_mesh


@contextmanager
def open_slicer(solid: Solid, options: Options, watch: Stopwatch) -> Iterator[Slicer]:
    """What cuts the core of the solid: samples of its grid, or its mesh in the stencil buffer."""
    if options.sections.slicer == "cpu":
        yield GridSampler(solid.core)
        return
    with watch.stage("surface"):
        vertices, faces = voxel_mesh(solid.core)
    with StencilSlicer(vertices, faces, solid.core.shape) as slicer:
        yield slicer


def cut_sections(
    slicer: Slicer, solid: Solid, flats: FloatArray, options: SectionOptions, watch: Stopwatch
) -> list[Section]:
    """The largest slice of each bin of directions and depths (section 4.2).

    Beyond the paper, the directions of large flat parts, ``flats`` (k, 3), are bins of their own.
    """
    with watch.stage("sections"):
        plan = plan_sections(solid.core, options, flats)
        return best_sections(plan, slicer, watch.steps("sections"))


def trace_outlines(sections: Sequence[Section], watch: Stopwatch) -> list[list[Polygon]]:
    """The outlines of each section with their holes (section 4.3)."""
    with watch.stage("loops"):
        return [edge_loops(section) for section in sections]


def build_chains(
    sections: Sequence[Section], polygons: Sequence[Sequence[Polygon]], watch: Stopwatch
) -> list[Chain]:
    """Each outline simplified and without holes (section 4.3), and ever simpler (section 4.4)."""
    chains: list[Chain] = []
    with watch.stage("chains"):
        tell = watch.steps("chains")
        for index, (section, pieces) in enumerate(zip(sections, polygons, strict=True)):
            tell(index / len(sections))
            for polygon in pieces:
                simplified = simplify_polygon(polygon, TOLERANCE_VOXELS)
                if simplified is not None:
                    chains.append(simplification_chain(bridge_holes(simplified), section.plane))
    return chains


def choose_triangles(
    chains: Sequence[Chain], solid: Solid, options: Options, drawn: FloatArray, watch: Stopwatch
) -> FloatArray:
    """(m, 3, 3) in grid space: the polygons that hide most within the budget (section 4.5).

    They add to what the ``drawn`` triangles hide.
    """
    with watch.stage("cut"):
        chosen = _choose(chains, solid, options, drawn, watch.steps("cut"))
        triangles = [NOTHING]
        for chain, level in zip(chains, chosen, strict=True):
            if level > 0:
                ring = chain.at(int(level))
                triangles.append(chain.plane.to_space(ring)[triangulate(ring)])
        return np.concatenate(triangles)


def _choose(
    chains: Sequence[Chain], solid: Solid, options: Options, drawn: FloatArray, tell: TellShare
) -> Cut:
    chosen = options.selection
    projections = search_projections(solid, options, chosen.views)
    standing = silhouettes(*as_mesh(drawn), projections)
    device = open_device(options.device)
    candidates = Candidates.from_chains(chains, projections, standing, device)
    if chosen.trim == "area":
        return trim_by_area(candidates, greedy_cut(candidates, chosen.alpha), chosen.budget)
    room = options.seed % 2**62  # each search adds its number, and the kernel takes 64 bits
    return choose_by_gain(candidates, chosen.budget, chosen.alpha, chosen.exchanges, room, tell)
