"""TriangleMesh, Solid -> Room: the solid and what lies around it in voxels finer than its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.overrides import Region
from simplifier.geometry.room import INTERIOR, SURFACE, WHOLE, Room
from simplifier.geometry.solid import BoolArray, Solid, VoxelGrid
from simplifier.kernels.room import add_layer, fill_rest, sort_cells, sum_cells, take_sides
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.voxelize import mark_all_triangles
from simplifier.voxel.core import barred_voxels
from simplifier.voxel.morphology import dilate

_STEPS = ((False, 1.0), (True, math.sqrt(3.0)), (False, 1.0))
"""Whether a layer goes across corners, and how far it goes then, in voxels; in turn."""


def coarse_room(
    core: VoxelGrid, reach: int, bound: float = 0.0, regions: Sequence[Region] = ()
) -> Room:
    """The voxels of a core and those within ``reach`` of it, without those of open regions.

    ``bound``  cells that any of them may be away from the surface.
    """
    allowed, margin = dilate(core, reach)
    allowed &= ~barred_voxels(core, regions, int(margin))
    shares = WHOLE * np.pad(core.inside, int(margin)).astype(np.uint8)
    return replace(Room.of(allowed, margin, bound), shares=shares)


def make_room(mesh: TriangleMesh, solid: Solid, size: int, far: float = math.sqrt(3.0)) -> Room:
    """The room of ``size`` voxels to a cell of the solid along each axis.

    A cell that the surface does not touch is as the solid has it.  In the others the voxels that
    the surface does not touch belong to the side, inside or out, that reaches them first.

    Around the solid lie as many layers as reach no further than ``far`` cells.  These grow across
    sides twice and across corners once, so that they are nearly as far off all around.  A solid
    that is kept wholly inside has none of them, and triangles keep to voxels that the surface does
    not touch.
    """
    reaches, away = [0.0, math.sqrt(3.0) / size], 0.0
    while (away := away + _STEPS[(len(reaches) - 2) % 3][1] / size) <= solid.reach * far:
        reaches.append(away + reaches[SURFACE])
    margin = math.ceil((len(reaches) - 2) / size) + 1
    touched = np.pad(solid.touched.inside, margin)
    filled = np.pad((solid.filled if solid.reach > 0 else solid.core).inside, margin)
    layers = np.empty([size * length for length in touched.shape], dtype=np.uint8)
    surface, around = _surface(mesh, solid, size, margin, layers)
    run_chunks(
        lambda begin, end: sort_cells(touched, filled, surface, around, begin, end, layers),
        len(touched),
    )
    take_sides(touched, filled, layers)
    run_chunks(lambda begin, end: fill_rest(touched, begin, end, layers), len(touched))
    for layer in range(SURFACE + 1, len(reaches)):  # none where the solid is kept wholly inside
        _add_layer(layers, _STEPS[(layer - 2) % 3][0], layer)
    shares = np.empty(touched.shape, dtype=np.uint8)
    # A voxel that is a cell is its own lowest and highest, which a fine grid need not hold thrice.
    least, most = (np.empty_like(shares) if size > 1 else layers for _ in range(2))
    run_chunks(lambda begin, end: sum_cells(layers, begin, end, least, most, shares), len(least))
    limit = len(reaches) - 1 if solid.reach > 0 else INTERIOR
    # A voxel of the solid lies in a cell that the surface touches, if not in one that is inside.
    slack = math.sqrt(3.0) * (1.0 - 1.0 / size)
    return Room(layers, least, most, shares, limit, tuple(reaches), float(margin), slack)


def _surface(
    mesh: TriangleMesh, solid: Solid, size: int, margin: int, layers: NDArray[np.uint8]
) -> tuple[BoolArray, int]:
    """The voxels that the surface touches, and how many the layers have around them.

    They are known where the solid was made of them.  Else they are marked in the layers' memory.
    """
    known = solid.touched if size == 1 else solid.finer
    if known is not None:
        return known.inside, margin * size
    origin = solid.touched.origin - margin * solid.touched.cell_size
    layers[:] = 0
    marks = layers.view(np.bool_)
    mark_all_triangles(mesh.vertices, mesh.faces, origin, size / solid.touched.cell_size, marks)
    return marks, 0


def _add_layer(layers: NDArray[np.uint8], corners: bool, layer: int) -> None:
    run_chunks(lambda begin, end: add_layer(layers, begin, end, corners, layer), len(layers))
