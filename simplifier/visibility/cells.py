"""Scene -> ViewCells: where viewers may be, on the ground between what stands on it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

import numpy as np

from simplifier.camera_paths.columns import Columns, UprightScene, blocked_band, columns_of
from simplifier.camera_paths.street import ground_heights, steep
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.files import read_bytes
from simplifier.options.simplify import Axis
from simplifier.options.visibility import PvsOptions

Placing = Literal["walkable", "grid"]

_MOST_COLUMNS = 2048  # along the longer side
_FINEST = 0.25  # of an eye height
_KERB, _HEADROOM = 0.3, 1.5  # eye heights: lower things are stepped over, higher ones are overhead
_MOST_CELLS = 10_000_000


def place_cells(upright: UprightScene, placing: Placing, options: PvsOptions) -> ViewCells:
    """Squares over the scene's plan, from the ground to the eyes of who stands on it.

    ``walkable``  those on which one can stand somewhere; ``grid`` all.  Raises
    :class:`OptionError` where there is no such place, and for more cells than ten million.
    """
    columns, ground, free = _ground(upright, options.eye_height)
    size = options.cell_size
    low, high = np.zeros(2), upright.extent[:2]
    count = np.maximum(np.ceil((high - low) / size - 1e-9), 1.0)
    if count.prod() > _MOST_CELLS:
        raise OptionError(
            f"{size:g} would make {int(count.prod()):,} cells", where="cell size",
            remedy=f"choose {size * float((count.prod() / _MOST_CELLS) ** 0.5):.3g} or more",
        )  # fmt: skip
    lows, highs = [], []
    for x in range(int(count[0])):
        for y in range(int(count[1])):
            corner = low + size * np.array([x, y])
            (x0, y0), (x1, y1) = columns.cells_of(np.stack([corner, corner + size]))
            there = slice(x0, x1 + 1), slice(y0, y1 + 1)
            if placing == "walkable" and not free[there].any():
                continue
            heights = ground[there]
            lows.append([*corner, heights.min()])
            highs.append([*(corner + size), heights.max() + options.eye_height])
    if not lows:
        raise OptionError(
            "there is no place to stand on", where="cells",
            remedy="choose --cells grid, or another --eye-height or --up",
        )  # fmt: skip
    return ViewCells.boxes(np.array(lows), np.array(highs))


def _ground(upright: UprightScene, eye: float) -> tuple[Columns, FloatArray, BoolArray]:
    """Heights of the ground over the scene's plan, and where one can stand."""
    high = upright.extent[:2]
    columns = columns_of(
        upright, np.zeros(2), high, max(float(high.max()) / _MOST_COLUMNS, _FINEST * eye)
    )
    ground, _ = ground_heights(columns, float(np.prod(high)), eye)
    blocked = blocked_band(upright, columns, ground + _KERB * eye, ground + _HEADROOM * eye)
    return columns, ground, ~blocked & ~steep(ground, columns.cell)


def load_cells(path: Path, up: Axis, origin: FloatArray) -> ViewCells:
    """Cells of a JSON file: ``{"cells": [{"low": [x, y, z], "high": [x, y, z]}, ...]}``, world.

    Their coordinates become those of the upright scene.  Raises :class:`OptionError` for what
    is no such file or has a cell that holds nothing.
    """
    where = str(path)
    data = read_bytes(path, error=OptionError, remedy="name a file of view cells")
    try:
        cells = json.loads(data)["cells"]
        corners = np.array([[_point(one["low"]), _point(one["high"])] for one in cells])
    except (ValueError, TypeError, KeyError) as error:
        raise OptionError(
            f"these are no view cells ({type(error).__name__}: {error})", where=where,
            remedy='write {"cells": [{"low": [x, y, z], "high": [x, y, z]}]}',
        ) from None  # fmt: skip
    if len(corners) == 0:
        raise OptionError("it has no cells", where=where, remedy="give it one or more")
    upright = corners[:, :, axis_order(up)] - origin
    return ViewCells.boxes(upright[:, 0], upright[:, 1])


def _point(values: Any) -> list[float]:
    point = [float(value) for value in values]
    if len(point) != 3 or not np.isfinite(point).all():
        raise ValueError(f"{values} is no point")
    return point
