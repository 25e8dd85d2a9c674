"""Room: where the triangles of an occluder may be, finer than the grid that they are found in."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

Layers = NDArray[np.uint8]

INTERIOR, SURFACE, NEVER = 0, 1, 255
"""Layers of voxels wholly inside, of those that the surface touches, and of those out of reach."""


WHOLE = 254
"""The share of a cell that is all inside; even, so that a half is whole too."""

EVERYWHERE: FloatArray = np.array([0.0, 0.0, 1.0, -np.inf, np.inf])
"""The slab of a mesh that lies in no thin one."""

EVERYWHERE.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Room:
    """Voxels by their layer: the solid's own come first, then one layer after the other around it.

    ``layers``    (k nx, k ny, k nz) uint8: :data:`INTERIOR`, :data:`SURFACE`, then rising outwards,
                  :data:`NEVER` past the last; k voxels to a cell along each axis.
    ``least``, ``most``  (nx, ny, nz) uint8: the lowest and the highest layer in each cell.
    ``shares``    (nx, ny, nz) uint8: of each cell, what is inside, in 254ths; a voxel that the
                  surface touches counts half.
    ``limit``     the highest layer that triangles may touch.
    ``reaches``   cells: how far from the solid's own voxels, and across one of these, a point of a
                  voxel may be, layer by layer.
    ``margin``    cells around the grid of the solid: a point p of grid space lies in cell
                  floor(p + margin).
    ``slack``     cells that the solid's own voxels may be away from the surface or from what is
                  known to be inside; 0 where that is known voxel by voxel.
    ``slab``      (5,) float64: two planes that the mesh lies between, past which triangles only
                  stick out: their unit normal, and how far they are along it, in the room's place.
    """

    layers: Layers
    least: Layers
    most: Layers
    shares: NDArray[np.uint8]
    limit: int
    reaches: tuple[float, ...]
    margin: float
    slack: float = 0.0
    slab: FloatArray = field(default_factory=lambda: EVERYWHERE)

    @classmethod
    def of(cls, allowed: BoolArray, margin: float = 0.0, reach: float = 0.0) -> Room:
        """The voxels that are set, (nx, ny, nz) bool, as a room of one voxel a cell.

        ``reach``  cells that any of them may be away from the surface.
        """
        layers = np.where(allowed, np.uint8(INTERIOR), np.uint8(NEVER))
        shares = WHOLE * allowed.astype(np.uint8)
        return cls(layers, layers, layers, shares, INTERIOR, (reach,), margin)

    def up_to(self, limit: int) -> Room:
        """The same with another limit."""
        return replace(self, limit=limit)

    def within(self, reach: float) -> Room:
        """The same with the highest limit, no higher than now, that reaches no further.

        As near as there is to it, which takes in what the surface touches.
        """
        limit = self.limit
        while limit > SURFACE and self.reaches[limit] > reach:
            limit -= 1
        return self.up_to(limit)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Cells along each axis."""
        nx, ny, nz = self.least.shape
        return nx, ny, nz

    @property
    def bound(self) -> float:
        """Cells that a triangle in the room may be away from the surface or the solid's inside."""
        return self.reaches[self.limit] + self.slack

    @property
    def voxels(self) -> tuple[Layers, Layers, Layers, int, NDArray[np.uint64], FloatArray]:
        """As :func:`~simplifier.kernels.voxelize.is_contained` takes it."""
        return self.layers, self.least, self.most, self.limit, self._barred, self.slab

    @cached_property
    def _barred(self) -> NDArray[np.uint64]:
        """What kernels find out about cells of 64 voxels; of others nothing is kept."""
        has_words = self.layers.size == 64 * self.least.size
        return np.zeros(self.least.shape if has_words else (0, 0, 0), dtype=np.uint64)

    @cached_property
    def cells(self) -> BoolArray:
        """(nx, ny, nz) bool: those with any room in them."""
        return np.asarray(self.least <= self.limit)

    @cached_property
    def cells_before(self) -> NDArray[np.int64]:
        """(nx ny + 1,) cells with room in the columns along z before each one, and in all.

        A table of the cells themselves would take more memory than all else in a fine grid.
        """
        counts = np.count_nonzero(self.cells, axis=2).ravel()
        return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
