"""A mesh in memory -> what a run on it will need, and its refusal where that is too much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from simplifier.geometry.grid import grid_shape
from simplifier.geometry.mesh import TriangleMesh
from simplifier.memory.limit import check_need
from simplifier.memory.need import MemoryNeed
from simplifier.memory.runs import Judging, judging, simplifying, solidifying
from simplifier.memory.stages import MeshSize, Shape
from simplifier.options import Options


def size_of(mesh: TriangleMesh) -> MeshSize:
    """Its vertices and triangles."""
    return MeshSize(len(mesh.vertices), len(mesh.faces))


def need_of_making(mesh: TriangleMesh, options: Options) -> MemoryNeed:
    """From the mesh to its occluder."""
    cell_size = float(mesh.extent.max()) / options.solid.resolution
    return simplifying(size_of(mesh), _shape(mesh, options), cell_size, options)


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
        making = need_of_making(mesh, chosen)
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
