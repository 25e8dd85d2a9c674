"""Occluders to refine from that are not made of planar sections.

A decimated surface covers a solid from all sides where the budget is large; sections hide more with
few triangles.  Which is better is for the measure to say: the search refines from several.
"""

from __future__ import annotations

from simplifier.geometry.grid import BoolArray, VoxelGrid
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.refinement.clustering import clustered
from simplifier.refinement.decimate import decimated
from simplifier.refinement.inner_surface import inner_surface
from simplifier.refinement.thinned import thinned
from simplifier.refinement.welding import welded


def enclosed_start(
    filled: VoxelGrid, allowed: BoolArray, margin: float, budget: int
) -> tuple[FloatArray, IntArray]:
    """The solid's smoothed surface in at most ``budget`` triangles, for what encloses a volume.

    ``allowed`` (nx, ny, nz) bool and ``margin``: as for :func:`~.decimate.decimated`.  Returns
    vertices (n, 3) float64 in grid space and faces (m, 3) int32, m at most the budget and 0 where
    the solid is nowhere thicker than a voxel.
    """
    return decimated(*inner_surface(filled), allowed, margin, budget)


def sheet_start(
    mesh: TriangleMesh, filled: VoxelGrid, allowed: BoolArray, margin: float, budget: int
) -> tuple[FloatArray, IntArray]:
    """The mesh itself in at most ``budget`` triangles, for open sheets and thin parts.

    Arguments and result as for :func:`enclosed_start`; ``mesh`` in world units.  Small components
    are given up first.
    """
    return decimated(*clustered(mesh, filled), allowed, margin, budget)


def fine_start(
    mesh: TriangleMesh, filled: VoxelGrid, allowed: BoolArray, margin: float, budget: int
) -> tuple[FloatArray, IntArray]:
    """The mesh itself in at most ``budget`` triangles, thinner than a voxel as it may be.

    Arguments and result as for :func:`sheet_start`, whose cells leave nothing of a thin rod, or a
    ribbon that is too wide.
    """
    return decimated(*welded(thinned(mesh, _MOST_FINE), filled), allowed, margin, budget)


_MOST_FINE = 20_000  # triangles that take a tenth of a second
