"""What whole runs need: the stages of each, with what is held all the while.

A mesh in memory -> what a run on it will need, and its refusal where that is too much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import grid_shape
from simplifier.memory import need as stages
from simplifier.memory.limit import check_need
from simplifier.memory.need import MemoryNeed, MeshSize, Shape
from simplifier.options.stages import Options


@dataclass(frozen=True)
class Judging:
    """How an occluder, or so many levels of detail, are judged.

    ``again``  whether another is made afterwards, and judged in the same pictures of the mesh.
    """

    views: int = 256
    image: int = 256
    levels: int = 1
    again: bool = False


def loading(vertices: int, triangles: int, decoding: int) -> MemoryNeed:
    """Of a file that claims so much."""
    return MemoryNeed({"load": stages.load(vertices, triangles, decoding)})


def solidifying(size: MeshSize, shape: Shape, cell_size: float, options: Options) -> MemoryNeed:
    """From a mesh in memory to its solid.  ``cell_size`` in world units."""
    hole, shrink = options.solid.smallest_hole / cell_size, options.solid.shrink / cell_size
    filling = stages.fill(shape, options.solid, hole, shrink)
    if options.solid.viewers == "inside":
        walking = stages.walk(size, shape, options.solid.eye_height / cell_size)
        filling = max(filling, walking)
    return MemoryNeed({"voxelize": stages.voxelize(shape), "fill": filling}).beside(size.held)


def simplifying(
    size: MeshSize, shape: Shape, cell_size: float, options: Options, how: Judging | None = None
) -> MemoryNeed:
    """From a mesh in memory to its occluder.  ``cell_size`` in world units.

    ``how``  other occluders of the mesh were judged before, if any were.
    """
    kept = stages.remembered(size, how.views, how.image) if how is not None and how.again else 0
    solid = stages.solid(shape, options)
    made: dict[str, int] = {}
    if options.sections.slicer == "gl":
        made["surface"] = solid + stages.surface(shape)
    made["sections"] = solid + stages.sections(shape, options.sections)
    made["refine"] = solid + stages.refine(size, shape, options)
    before = solidifying(size, shape, cell_size, options).beside(stages.finer(shape, options))
    return before.joined(MemoryNeed(made).beside(size.held)).beside(kept)


def seeing(size: MeshSize, how: Judging) -> MemoryNeed:
    """Accuracy alone."""
    drawing = stages.views(size, how.views, how.image, how.levels)
    counting = stages.quads(how.views, how.image, how.levels)
    beside = stages.overhang(size, how.views, how.levels)
    before = stages.front(size, how.views, how.levels)
    return MemoryNeed({"accuracy": max(drawing, counting, beside, before)}).beside(size.held)


def judging(size: MeshSize, shape: Shape, options: Options, how: Judging) -> MemoryNeed:
    """Accuracy, deviation and report of an occluder, whose solid is still there."""
    solid = stages.solid(shape, options)
    report = max(stages.report(size), stages.deviation(size, shape, options))
    told = MemoryNeed({"report": report}).beside(size.held)
    return seeing(size, how).joined(told).beside(solid)


def drawing(size: MeshSize, shape: Shape, options: Options) -> MemoryNeed:
    """Pictures for the page, of an occluder whose solid is still there."""
    need = stages.solid(shape, options) + stages.pictures(size)
    return MemoryNeed({"pictures": need}).beside(size.held)


def showing(size: MeshSize) -> MemoryNeed:
    """A copy of the mesh to look at."""
    return MemoryNeed({"viewing": stages.viewing(size)}).beside(size.held)


def size_of(mesh: TriangleMesh) -> MeshSize:
    """Its vertices and triangles."""
    return MeshSize(len(mesh.vertices), len(mesh.faces))


def need_of_making(mesh: TriangleMesh, options: Options, how: Judging | None = None) -> MemoryNeed:
    """From the mesh to its occluder; ``how`` as of :func:`simplifying`."""
    cell_size = float(mesh.extent.max()) / options.solid.resolution
    return simplifying(size_of(mesh), _shape(mesh, options), cell_size, options, how)


def need_of_solid(mesh: TriangleMesh, options: Options) -> MemoryNeed:
    """From the mesh to its solid."""
    cell_size = float(mesh.extent.max()) / options.solid.resolution
    return solidifying(size_of(mesh), _shape(mesh, options), cell_size, options)


def need_of_judging(mesh: TriangleMesh, options: Options, how: Judging) -> MemoryNeed:
    """Of an occluder that was made with these options."""
    return judging(size_of(mesh), _shape(mesh, options), options, how)


def check_making(
    mesh: TriangleMesh,
    options: Options,
    memory_limit: float | None,
    judged: Judging | None = None,
) -> None:
    """Raise :class:`~simplifier.errors.MemoryLimitError` before the mesh's occluder is made, and
    ``judged`` if so, where that would need more than ``memory_limit`` GiB, None for half of the
    machine's."""

    def need(chosen: Options) -> MemoryNeed:
        making = need_of_making(mesh, chosen, judged)
        return making if judged is None else making.joined(need_of_judging(mesh, chosen, judged))

    check_options(need, options, memory_limit)


def check_options(
    need: Callable[[Options], MemoryNeed], options: Options, memory_limit: float | None
) -> None:
    """The same for any need that depends on options: the message names a resolution that fits."""

    def at(resolution: int) -> MemoryNeed:
        return need(replace(options, solid=replace(options.solid, resolution=resolution)))

    check_need(need(options), memory_limit, resolution=options.solid.resolution, at=at)


def _shape(mesh: TriangleMesh, options: Options) -> Shape:
    return grid_shape(mesh.extent, options.solid.resolution)
