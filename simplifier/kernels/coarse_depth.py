"""Blocks of pixels against one depth, by tiles where those settle it."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel
from simplifier.kernels.depth_buffer import ERROR, FARTHEST, STALE, TILE, TILE_SHIFT


@kernel
def is_block_nearer(depth, tiles, value, first_row, last_row, first_column, last_column):
    """Whether all of a block of pixels are nearer.

    ``value``  float32, the reciprocal depth that they must exceed.
    """
    for tile_row in range(first_row >> TILE_SHIFT, (last_row >> TILE_SHIFT) + 1):
        for tile in range(first_column >> TILE_SHIFT, (last_column >> TILE_SHIFT) + 1):
            if not is_tile_nearer(depth, tiles, tile_row, tile, value):
                row, column = tile_row << TILE_SHIFT, tile << TILE_SHIFT
                least = least_of(
                    depth,
                    max(first_row, row), min(last_row, row + TILE - 1),
                    max(first_column, column), min(last_column, column + TILE - 1),
                )  # fmt: skip
                if not least > value:
                    return False
    return True


@inline_kernel
def largest_blur(tiles, first_row, last_row, first_column, last_column):
    """Largest screen error of the tiles of a block of pixels."""
    blur = np.float32(0.0)
    for tile_row in range(first_row >> TILE_SHIFT, (last_row >> TILE_SHIFT) + 1):
        for tile in range(first_column >> TILE_SHIFT, (last_column >> TILE_SHIFT) + 1):
            blur = max(blur, tiles[ERROR, tile_row, tile])
    return blur


@inline_kernel
def is_tile_nearer(depth, tiles, tile_row, tile, value):
    """Whether all pixels of a tile are nearer; a stale tile is made fresh when it would not be."""
    if tiles[FARTHEST, tile_row, tile] > value:
        return True
    if tiles[STALE, tile_row, tile] == 0.0:
        return False
    row, column = tile_row << TILE_SHIFT, tile << TILE_SHIFT
    tiles[STALE, tile_row, tile] = 0.0
    tiles[FARTHEST, tile_row, tile] = least_of(
        depth, row, row + TILE - 1, column, column + TILE - 1
    )
    return tiles[FARTHEST, tile_row, tile] > value


@kernel
def least_of(depth, first_row, last_row, first_column, last_column):
    """Least reciprocal depth of a block of pixels, ends included."""
    least = np.float32(np.inf)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            least = min(least, depth[row, column])
    return least
