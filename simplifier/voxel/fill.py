"""VoxelGrid -> VoxelGrid: what the outside cannot reach is inside (section 4.1 of the paper)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.grid import BoolArray, VoxelGrid
from simplifier.kernels.fill import flood

Side = tuple[int, int]
"""(axis 0 to 2, 0 for the low or -1 for the high end)."""


def fill(touched: VoxelGrid, closed_sides: frozenset[Side] = frozenset()) -> VoxelGrid:
    """Add the free voxels that no open side of the grid can reach in steps across faces.

    ``touched``       the voxels that the surface touches.
    ``closed_sides``  sides of the grid that the outside does not enter from: the ground that the
                      asset stands on.

    The 6-connected components of the free voxels that reach an open side are outside; all else is
    inside.
    """
    free = ~touched.inside
    reached = _pack(_seeds(free, closed_sides))
    flood(_pack(free), reached)
    return touched.with_inside(~_unpack(reached, touched.shape[2]))


def _seeds(free: BoolArray, closed_sides: frozenset[Side]) -> BoolArray:
    seeds = np.zeros_like(free)
    for axis in range(3):
        for end in (0, -1):
            if (axis, end) not in closed_sides:
                border = tuple(end if i == axis else slice(None) for i in range(3))
                seeds[border] = free[border]
    return seeds


def _pack(voxels: BoolArray) -> NDArray[np.uint64]:
    """(nx, ny, nz) bool to (nx, ny, words) uint64, bit z % 64 of word z // 64."""
    words = -(-voxels.shape[2] // 64)
    octets = np.packbits(voxels, axis=2, bitorder="little")
    padded = np.zeros((*voxels.shape[:2], words * 8), dtype=np.uint8)
    padded[:, :, : octets.shape[2]] = octets
    return padded.view("<u8").astype(np.uint64, copy=False)


def _unpack(bits: NDArray[np.uint64], depth: int) -> BoolArray:
    octets = bits.astype("<u8", copy=False).view(np.uint8)
    return np.unpackbits(octets, axis=2, count=depth, bitorder="little").view(np.bool_)
