"""Triangles below a node -> its occluder, with an error that is proved (section 5 of the paper)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from simplifier.accuracy.deviation import SLACK, deviation_from_solid
from simplifier.errors import CancelledError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.options.scene import SceneOptions
from simplifier.options.simplify import MOST_MOVES, MOST_VOXELS, Axis
from simplifier.options.stages import Options, SectionOptions, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Cancel
from simplifier.selection.measure import hiding_radius
from simplifier.steps.largest import largest_triangles

COARSENESS = 2.0
"""Voxels of a node that its occluder strays at least, or lacks where it keeps wholly inside."""

NodeKind = Literal["near", "far", "inner"]
"""Of a leaf's two occluders: narrow, and cheaper with an error; or that of an inner node."""

_SECTIONS = SectionOptions(directions=8, depths=3)
_VIEWS = 40  # that the search looks from; a scene has thousands of nodes
_NEAR_EFFORT = 2  # times the moves: drawn from near by, and for all instances of its mesh
_ALIKE = 0.995  # precision of the others: their error is what they are chosen by
_FINER = 2  # times the voxels of what keeps wholly inside: it loses up to one on every side
_ITSELF = 4  # times the budget: with fewer triangles a mesh is its own near occluder
_SHARES: dict[NodeKind, float] = {"near": 1.0, "far": 0.25, "inner": 0.5}  # of the budget


@dataclass(frozen=True)
class Stand:
    """How triangles stand in the world, said in their own space.

    ``ground``         the axis whose low end is the ground, which nothing enters from; None for no
                       ground.
    ``smallest_hole``  openings narrower than this count as closed; 0 closes none.
    """

    ground: Axis | None = None
    smallest_hole: float = 0.0


def node_occluder(
    mesh: TriangleMesh,
    kind: NodeKind,
    stand: Stand,
    options: SceneOptions,
    cancel: Cancel | None = None,
) -> Occluder:
    """The occluder of the triangles below a node; without faces if it would hide nothing.

    ``mesh`` and the result are in one space: a leaf's is that of its mesh, an inner node's the
    world.

    The *near* one of a leaf is narrow, so it can be drawn from anywhere: the triangles themselves
    if they are few, else what hides more, the largest of them or an occluder that covers no more
    beside them than ``options.overhang``; with an overhang of 0 it keeps wholly inside.  The *far*
    one has a quarter of the budget and an error: from where that does not show, a node of 64 voxels
    is a dozen pixels wide.  An inner node's is made after one dilation step, which glues neighbours
    together, with half of the budget, as there is more below it.

    ``error_bound`` is what was measured and is proved: no point of the occluder is further from the
    triangles or from the interior that they enclose.  Raises
    :class:`~simplifier.errors.CancelledError` also when it is cancelled while refining: the best so
    far is not what the same input gives another time.
    """
    if kind == "near" and is_own_occluder(mesh, options):
        return _worth(Occluder(mesh.vertices, mesh.faces, 0.0), mesh, options.resolution)
    result = simplify_mesh(
        mesh, node_options(float(mesh.extent.max()), kind, stand, options), cancel=cancel,
        warn=False,
    )  # fmt: skip
    if result.interrupted:
        raise CancelledError("cancelled before the occluder was as good as asked for")
    made = result.occluder
    proved = made.error_bound
    if proved > 0.0:
        strays = deviation_from_solid(made, mesh, result.solid)
        proved = min(proved, strays + SLACK * result.solid.core.cell_size)
    found = Occluder(made.vertices, made.faces, proved)
    if kind == "near":
        largest = Occluder.of(largest_triangles(mesh, _ITSELF * options.budget), 0.0, {})
        found = max(found, largest, key=hiding_radius)
    return _worth(found, mesh, options.resolution)


def is_own_occluder(mesh: TriangleMesh, options: SceneOptions) -> bool:
    """Whether a mesh has so few triangles that no other near occluder is worth making."""
    return len(mesh.faces) <= _ITSELF * options.budget


def node_options(longest: float, kind: NodeKind, stand: Stand, options: SceneOptions) -> Options:
    """Of a node whose longest edge is that, in the space of its occluder."""
    return _kept_options(kind, stand.ground, min(stand.smallest_hole, longest), options)


@lru_cache(maxsize=256)
def _kept_options(
    kind: NodeKind, ground: Axis | None, smallest_hole: float, options: SceneOptions
) -> Options:
    """The same for most of a scene's thousands of nodes, and checked field by field."""
    resolution, near = options.resolution, kind == "near"
    inside = options.conservative or (near and options.overhang == 0.0)
    if near and inside:
        resolution = min(_FINER * resolution, MOST_VOXELS)
    budget = max(1, round(options.budget * _SHARES[kind]))
    made = make_options(  # of a mesh of any length: the hole keeps to it, and no bound is asked for
        math.inf, budget=budget, resolution=resolution, up=ground or "y",
        ground=ground is not None, smallest_hole=smallest_hole,
        # Viewers are between the objects, where a street is seen from few directions.
        fill="flood", conservative=inside, seed=options.seed,
        overhang=options.overhang if near and not inside else 1.0,
        min_precision=None if near and not inside else _ALIKE,
        moves=min(options.moves * (_NEAR_EFFORT if near else 1), MOST_MOVES),
    )  # fmt: skip
    return replace(
        made,
        solid=replace(made.solid, glue=kind == "inner"),
        sections=_SECTIONS,
        # A near one is drawn most, and of many triangles a decimated surface is mostly the best.
        refine=replace(made.refine, views=_VIEWS, searches=1, decimated=near and not inside),
    )


def _worth(occluder: Occluder, mesh: TriangleMesh, resolution: int) -> Occluder:
    """The occluder, or none where it hides less than a disc of a voxel's radius."""
    voxel = float(mesh.extent.max()) / resolution
    if hiding_radius(occluder) >= voxel:
        return occluder
    return Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), occluder.error_bound)
