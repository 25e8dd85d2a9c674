"""Terrain -> ViewCells: squares that stand on it, or columns over its tiles."""

from __future__ import annotations

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.terrain import measure_boxes
from simplifier.options.visibility import Placing, PvsOptions
from simplifier.visibility.placing.cells import cells_across
from simplifier.visibility.solid.object_heights import rounded_down, rounded_up
from simplifier.visibility.solid.terrain import Terrain

_STEEP = 1.0  # height by length: 45 degrees, as elsewhere
_SLIVER = 1e-3  # of a cell: what is left of the plan at the end is no cell of its own


def place_on_terrain(
    terrain: Terrain, upright: UprightScene, placing: Placing, options: PvsOptions
) -> ViewCells:
    """Squares over the terrain's plan, from its lowest point there to an eye over its highest.

    ``walkable``  those with a triangle no steeper than 45 degrees; ``grid`` all that have a
    surface.  The last ones along x and y end with the terrain.  Raises :class:`OptionError` where
    there is no such place, and for more cells than ten million.
    """
    _check_placing(placing)
    size = options.cell_size
    extent = np.array(terrain.elevation.spacing) * (np.array(terrain.heights.shape) - 1)
    count = cells_across(extent, size, _SLIVER)
    x, y = (axis.ravel() for axis in np.meshgrid(*map(np.arange, count), indexing="ij"))
    low = size * np.stack([x, y], axis=1)
    high: FloatArray = np.minimum(low + size, extent)
    return _standing(terrain, upright, np.asarray(low), high, placing, options)


def place_columns(
    terrain: Terrain, upright: UprightScene, placing: Placing, options: PvsOptions
) -> ViewCells:
    """The plans of the terrain's tiles, otherwise as :func:`place_on_terrain` has its squares."""
    _check_placing(placing)
    count = np.array(terrain.heights.shape) - 1
    columns, rows = (axis.ravel() for axis in np.indices(terrain.numbers.shape))
    ends = count[1] - terrain.tile * rows  # tiles are counted from the north
    low = np.stack([terrain.tile * columns, np.maximum(ends - terrain.tile, 0)], axis=1)
    high = np.stack([np.minimum(low[:, 0] + terrain.tile, count[0]), ends], axis=1)
    spacing = np.array(terrain.elevation.spacing)
    return _standing(terrain, upright, low * spacing, high * spacing, placing, options)


def _check_placing(placing: Placing) -> None:
    if placing in ("triangles", "floors"):
        kind = "free space for triangles" if placing == "triangles" else "rooms with floors"
        raise OptionError(
            f"a terrain has no {kind}", where="cells", remedy="choose walkable or grid"
        )


def _standing(
    terrain: Terrain, upright: UprightScene, low: FloatArray, high: FloatArray, placing: Placing,
    options: PvsOptions,
) -> ViewCells:  # fmt: skip
    """Boxes over plans ``low`` to ``high`` (n, 2), from the south-west post."""
    first = terrain.corner - upright.origin[:2]
    spacing = np.array(terrain.elevation.spacing)
    boxes = np.stack([low, high], axis=2) / spacing[:, None]  # (n, 2, 2): axis, end
    lows, highs, slopes = np.empty(len(low)), np.empty(len(low)), np.empty(len(low))
    measure_boxes(
        terrain.heights, terrain.known, np.ascontiguousarray(boxes.reshape(-1, 4)), spacing, lows,
        highs, slopes,
    )  # fmt: skip
    chosen = lows <= highs
    if placing == "walkable":
        chosen &= slopes <= _STEEP
    if not chosen.any():
        raise OptionError(
            "there is no place to stand on", where="cells", remedy="choose --cells grid"
        )
    ground, roof = lows - upright.origin[2], highs - upright.origin[2] + options.eye_height
    # Cells are float32: those at the border must not end beyond it.
    begin, end = rounded_up(low + first), rounded_down(high + first)
    return ViewCells.boxes(
        np.column_stack([begin, ground])[chosen], np.column_stack([end, roof])[chosen]
    )
