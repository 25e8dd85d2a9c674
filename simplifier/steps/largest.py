"""Triangles, TriangleMesh -> triangles: what keeps inside, with triangles of the mesh itself.

These hide nothing that the mesh does not, so they may stand where nothing else may leave what is
inside.  A wall that is thinner than two voxels has nothing wholly inside, and one of a few voxels
loses most of its thickness.
"""

from __future__ import annotations

from heapq import heapify, heapreplace

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.overrides import NOTHING, Overrides
from simplifier.geometry.solid import Solid
from simplifier.kernels.bit_image import SIZE
from simplifier.kernels.soup_views import draw_soup, empty_pictures
from simplifier.kernels.threads import run_chunks
from simplifier.options.stages import Options, SolidOptions
from simplifier.refinement.depths import NO_DEPTHS
from simplifier.selection.measure import hiding_radius, search_projections

_CANDIDATES = 4  # times the budget: of so many of the largest those are chosen that add most
_MOST = 400  # triangles of a budget: pictures of the candidates of more would take much memory
_VIEWS = 32
_AT_ONCE = 4096  # triangles, whose corners stay in the cache
_GAIN = 1.07  # times the radius, about 1.5 times the recall: for less all keeps its distance


def with_largest(
    found: FloatArray, mesh: TriangleMesh, solid: Solid, options: Options
) -> tuple[FloatArray, list[str]]:
    """(m, 3, 3) in world units, m at most the budget: those ``found`` (k, 3, 3), or of these and
    the largest of the mesh those that hide most together, where that is more; and what to say."""
    chosen, budget = NOTHING, options.selection.budget
    if budget <= _MOST:
        both = np.concatenate([found, largest_triangles(mesh, _CANDIDATES * budget)])
        chosen = _adding_most(both, solid, options)
    if len(chosen) == 0:  # or all are thinner than a pixel
        chosen = largest_triangles(mesh, budget)
    if len(found) > 0 and _radius(chosen) <= _GAIN * _radius(found):
        return found, []
    return chosen, ["Triangles of the mesh itself, which hide nothing else, are among them."]


def _radius(triangles: FloatArray) -> float:
    return hiding_radius(Occluder.of(triangles, 0.0, {}))


def may_lend(options: SolidOptions, overrides: Overrides) -> bool:
    """Whether triangles of the mesh may stand among those that keep inside: not where these keep at
    some length from it, nor where a person decided what hides."""
    return options.shrink == 0.0 and not overrides.drawn and not overrides.open


def largest_triangles(mesh: TriangleMesh, count: int) -> FloatArray:
    """(m, 3, 3) in world units, m at most ``count``: those of largest area, in the mesh's order."""
    if count >= len(mesh.faces):
        return np.asarray(mesh.vertices[mesh.faces])
    areas = np.empty(len(mesh.faces))

    def work(begin: int, end: int) -> None:
        a, b, c = (mesh.vertices[mesh.faces[begin:end, corner]] for corner in range(3))
        areas[begin:end] = np.linalg.norm(np.cross(b - a, c - a), axis=1)

    run_chunks(work, len(areas), least=_AT_ONCE, chunks_per_thread=64)
    # Of several that are as large as the last one, the first.
    least = np.partition(areas, -count)[-count]
    larger, alike = np.flatnonzero(areas > least), np.flatnonzero(areas == least)
    chosen = np.sort(np.concatenate([larger, alike[: count - len(larger)]]))
    return np.asarray(mesh.vertices[mesh.faces[chosen]])


def _adding_most(triangles: FloatArray, solid: Solid, options: Options) -> FloatArray:
    """Of triangles (m, 3, 3) within the budget, one after another, the one that adds most pixels.

    That covers at least 1 - 1/e of what the best choice would (Nemhauser, Wolsey and Fisher, "An
    analysis of approximations for maximizing submodular set functions", 1978).
    """
    projections = search_projections(solid, options, _VIEWS)
    images, layers = empty_pictures(len(triangles), _VIEWS, SIZE)
    placed, standing = solid.core.to_grid(triangles), np.zeros((_VIEWS, SIZE), dtype=np.uint64)
    draw_soup(placed, projections, NO_DEPTHS.arrays(), standing, images, layers)
    chosen: list[int] = []
    free = np.full_like(standing, ~np.uint64(0))

    def added(index: int) -> int:
        return int(np.bitwise_count(images[index] & free).sum())

    # What one adds only falls as others are chosen, so an old number is the most that it may add.
    waiting = [(-added(index), index) for index in range(len(triangles))]
    heapify(waiting)
    while len(chosen) < options.selection.budget and waiting[0][0] < 0:
        index = waiting[0][1]
        now = (-added(index), index)
        if heapreplace(waiting, now) == now:
            chosen.append(index)
            free &= ~images[index]
    return triangles[sorted(chosen)]
