"""Solid: what the input touches, what that encloses, and what closed it.

VoxelGrid: a solid in cubic cells, and the map between grid space and the world.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import MeshError
from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.mesh import FloatArray


@dataclass(frozen=True)
class Closing:
    """What kept the outside out, and the voxels that it added to the solid."""

    by: str  # "ground", "smallest_hole" or "sight"
    voxels: int


@dataclass(frozen=True, eq=False)
class Solid:
    """The discretized input (section 4.1 of the paper).

    ``touched``  voxels that a triangle touches.
    ``filled``   those, and the voxels that the outside cannot reach or hardly sees.
    ``core``     what sections are cut from: ``filled``, or only voxels that lie wholly inside;
                 without the regions that are to be left open.
    ``reach``    voxels that the occluder may go past the core: 1, or 0 for not at all.
    ``wholly_inside``  whether the core is the interior alone, without any touched voxel.
    ``inner``    what is inside without touching a triangle, in finer voxels, where triangles or
                 their error bound keep to those.
    ``open``     whether that may be seen past, since the mesh has a border; what is not kept wholly
                 inside is not asked.
    ``closed_by``  what closed the surface, in the order in which it was applied.
    ``opened``   voxels that viewers inside see, which would be inside without these.
    ``finer``    what a triangle touches in the voxels of the room, until there is one.
    """

    touched: VoxelGrid
    filled: VoxelGrid
    core: VoxelGrid
    reach: int = 1
    closed_by: tuple[Closing, ...] = ()
    wholly_inside: bool = False
    open: bool = False
    inner: VoxelGrid | None = None
    opened: int = 0
    finer: VoxelGrid | None = None

    @property
    def interior(self) -> VoxelGrid:
        """What is inside without touching a triangle, as finely as it is known."""
        if self.inner is not None:
            return self.inner
        return self.filled.with_inside(self.filled.bits - self.touched.bits)

    @property
    def inside_fraction(self) -> float:
        """Share of the grid's voxels that the solid holds."""
        return self.filled.count / math.prod(self.filled.shape)

    @property
    def enclosed_fraction(self) -> float:
        """Voxels that are inside without touching a triangle, as a share of the solid."""
        return 1.0 - self.touched.count / self.filled.count

    @property
    def is_sheet(self) -> bool:
        """Whether the surface encloses next to nothing."""
        return self.enclosed_fraction < _SHEET


_SHEET = 0.01  # of the solid: what a sheet may enclose


BoolArray = NDArray[np.bool_]

_SMALLEST_CELL = 1e-290  # world units; below, float64 loses digits and its reciprocal overflows


class VoxelGrid:
    """Cubic voxels over the bounding box of a mesh.

    ``solid``      which voxels belong to the solid, as (nx, ny, nz) bool, C order, or as bits.
    ``origin``     (3,) float64: the grid's lowest corner, world units.
    ``cell_size``  edge of a voxel, world units.

    Voxel (i, j, k) is the cube from (i, j, k) to (i+1, j+1, k+1) in grid space.
    """

    def __init__(self, solid: BoolArray | BitGrid, origin: FloatArray, cell_size: float) -> None:
        if not isinstance(solid, BitGrid):
            solid.setflags(write=False)
        self._solid = solid
        self.origin = origin
        self.cell_size = cell_size
        nx, ny, nz = solid.shape
        self.shape: tuple[int, int, int] = (nx, ny, nz)

    @cached_property
    def inside(self) -> BoolArray:
        """(nx, ny, nz) bool, C order; read-only."""
        solid = self._solid
        if not isinstance(solid, BitGrid):
            return solid
        inside = solid.voxels
        inside.setflags(write=False)
        return inside

    @cached_property
    def bits(self) -> BitGrid:
        """The same as bits, which steps over a whole grid take."""
        solid = self._solid
        return solid if isinstance(solid, BitGrid) else BitGrid.of(solid)

    @cached_property
    def count(self) -> int:
        """Number of voxels of the solid."""
        return self.bits.count

    def with_inside(self, solid: BoolArray | BitGrid) -> VoxelGrid:
        """The same grid with another solid in it."""
        return VoxelGrid(solid, self.origin, self.cell_size)

    def to_world(self, points: FloatArray) -> FloatArray:
        """Grid space (…, 3) to world units."""
        return np.asarray(points * self.cell_size + self.origin)

    def to_grid(self, points: FloatArray) -> FloatArray:
        """World units (…, 3) to grid space."""
        placed = np.asarray(points - self.origin)
        placed /= self.cell_size
        return placed

    def in_voxels(self, length: float) -> float:
        """A length in world units as voxels."""
        return length / self.cell_size

    @cached_property
    def column_ends(self) -> FloatArray:
        """(n, 3) grid space: centres of the first and last inside voxel of each column along z.

        They span the same as all inside voxels do, and are few.
        """
        columns = self.inside.any(axis=2)
        first = self.inside.argmax(axis=2)[columns]
        last = self.shape[2] - 1 - self.inside[:, :, ::-1].argmax(axis=2)[columns]
        places = np.argwhere(columns)
        ends = [np.column_stack([places, depth]) for depth in (first, last)]
        return np.asarray(np.concatenate(ends) + 0.5)


def grid_shape(extent: FloatArray, resolution: int) -> tuple[int, int, int]:
    """Voxels along each axis of the grid of a mesh whose bounding box has those edges.

    Raises :class:`MeshError` as :func:`cells_of`.
    """
    nx, ny, nz = cells_of(extent, resolution)[0].tolist()
    return nx, ny, nz


def cells_of(extent: FloatArray, resolution: int) -> tuple[NDArray[np.int64], float]:
    """Voxels along each axis, (3,), and the edge of a voxel, world units.

    ``resolution`` (1 or more) voxels lie along the longest edge of the ``extent``; the other axes
    get as many as they need, at least one.  Raises :class:`MeshError` for an extent below 1e-290
    world units a voxel.
    """
    cell_size = float(extent.max()) / resolution
    if cell_size < _SMALLEST_CELL:
        raise MeshError(
            f"the mesh is {extent.max():g} units long, too small to divide into voxels",
            remedy="scale it up",
        )
    # An extent of 3.0000000001 cells is 3 cells and a rounding error, not 4.
    whole = np.ceil(extent / cell_size - 1e-9).astype(np.int64)
    return np.maximum(whole, 1), cell_size
