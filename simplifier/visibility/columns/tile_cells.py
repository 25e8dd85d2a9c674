"""Terrain, options -> whether voxel columns serve better than cull maps, and their cells.

A column is over a whole tile, so smaller cells have the sets of it all, which are twice those of
cull maps where cells are a tenth as wide (docs/decisions/0024-how-the-method-is-chosen.md).
"""

from __future__ import annotations

from simplifier.options.visibility import PvsOptions
from simplifier.visibility.solid.terrain import Terrain

_POSTS = 2.0  # eroded: with so many, voxel columns hide less than cull maps do


def tile_size(terrain: Terrain) -> tuple[float, float]:
    """Edges of a whole tile along x and y, world units."""
    x, y = terrain.elevation.spacing
    return terrain.tile * x, terrain.tile * y


def columns_serve(terrain: Terrain, options: PvsOptions) -> bool:
    """Whether anything but the cells keeps ``--method auto`` from voxel columns.

    Their sweeps serve all cells or none, so a time limit does.
    """
    own = options.fill == "viewers" or options.backend == "opengl" or options.slices
    coarse = options.epsilon is not None and options.epsilon >= _POSTS * max(
        terrain.elevation.spacing
    )
    return not own and not coarse and options.time_limit is None


def tiles_as_cells(terrain: Terrain, options: PvsOptions) -> bool:
    """Whether ``--method auto`` takes the tiles' plans as cells: where squares are no smaller."""
    wide = options.cell_size >= max(tile_size(terrain))
    return options.method == "auto" and wide and columns_serve(terrain, options)
