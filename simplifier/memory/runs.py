"""What whole runs need: the stages of each, with what is held all the while."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.memory import stages
from simplifier.memory.need import MemoryNeed
from simplifier.memory.stages import MeshSize, Shape
from simplifier.options import Options


@dataclass(frozen=True)
class Judging:
    """How an occluder, or so many levels of detail, are judged."""

    views: int = 256
    image: int = 256
    levels: int = 1


def loading(vertices: int, triangles: int, decoding: int) -> MemoryNeed:
    """Of a file that claims so much."""
    return MemoryNeed({"load": stages.load(vertices, triangles, decoding)})


def solidifying(size: MeshSize, shape: Shape, cell_size: float, options: Options) -> MemoryNeed:
    """From a mesh in memory to its solid.  ``cell_size`` in world units."""
    hole, shrink = options.solid.smallest_hole / cell_size, options.solid.shrink / cell_size
    filling = stages.fill(shape, options.solid, hole, shrink)
    return MemoryNeed({"voxelize": stages.voxelize(shape), "fill": filling}).beside(size.held)


def simplifying(size: MeshSize, shape: Shape, cell_size: float, options: Options) -> MemoryNeed:
    """From a mesh in memory to its occluder.  ``cell_size`` in world units."""
    solid = stages.solid(shape, options.solid)
    made: dict[str, int] = {}
    if options.sections.slicer == "gl":
        made["surface"] = solid + stages.surface(shape)
    made["sections"] = solid + stages.sections(shape, options.sections)
    made["refine"] = solid + stages.refine(size, shape, options)
    before = solidifying(size, shape, cell_size, options)
    return before.joined(MemoryNeed(made).beside(size.held))


def seeing(size: MeshSize, how: Judging) -> MemoryNeed:
    """Accuracy alone."""
    views = stages.views(size, how.views, how.image, how.levels)
    return MemoryNeed({"accuracy": views}).beside(size.held)


def judging(size: MeshSize, shape: Shape, options: Options, how: Judging) -> MemoryNeed:
    """Accuracy, deviation and report of an occluder, whose solid is still there."""
    solid = stages.solid(shape, options.solid)
    report = max(stages.report(size), stages.deviation(size, shape))
    told = MemoryNeed({"report": report}).beside(size.held)
    return seeing(size, how).joined(told).beside(solid)


def drawing(size: MeshSize, shape: Shape, options: Options) -> MemoryNeed:
    """Pictures for the page, of an occluder whose solid is still there."""
    need = stages.solid(shape, options.solid) + stages.pictures(size)
    return MemoryNeed({"pictures": need}).beside(size.held)


def showing(size: MeshSize) -> MemoryNeed:
    """A copy of the mesh to look at."""
    return MemoryNeed({"viewing": stages.viewing(size)}).beside(size.held)
