"""Terrain -> ViewCells: squares that stand on it."""

from __future__ import annotations

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.terrain import measure_boxes
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.placing.cells import Placing, cells_across
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
    if placing in ("triangles", "floors"):
        kind = "free space for triangles" if placing == "triangles" else "rooms with floors"
        raise OptionError(
            f"a terrain has no {kind}", where="cells", remedy="choose walkable or grid"
        )
    size = options.cell_size
    first = terrain.corner - upright.origin[:2]
    spacing = np.array(terrain.elevation.spacing)
    extent = spacing * (np.array(terrain.heights.shape) - 1)
    count = cells_across(extent, size, _SLIVER)
    x, y = (axis.ravel() for axis in np.meshgrid(*map(np.arange, count), indexing="ij"))
    low = size * np.stack([x, y], axis=1)
    high = np.minimum(low + size, extent)
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
    low, high = rounded_up(low + first), rounded_down(high + first)
    return ViewCells.boxes(
        np.column_stack([low, ground])[chosen], np.column_stack([high, roof])[chosen]
    )
