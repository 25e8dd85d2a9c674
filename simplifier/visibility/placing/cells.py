"""Scene -> ViewCells: where viewers may be, on the ground between what stands on it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import sparse

from simplifier.camera_paths.columns import Columns, UprightScene, blocked_band, columns_of
from simplifier.camera_paths.interior import floors_indoors
from simplifier.camera_paths.street import AROUND, ground_heights, steep
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.files import read_bytes
from simplifier.options.simplify import Axis
from simplifier.options.visibility import Placing, PvsOptions
from simplifier.visibility.placing.free_space import free_space, triangles_of
from simplifier.visibility.solid.height_field import plans_of
from simplifier.visibility.solid.object_heights import rounded_down, rounded_up

_MOST_COLUMNS = 2048  # along the longer side
_FINEST = 0.25  # of an eye height
_KERB, _HEADROOM = 0.3, 1.5  # eye heights: lower things are stepped over, higher ones are overhead
_MOST_CELLS = 10_000_000
_MOST_OPEN = 0.5  # of the plan: the hull of what is open and wider is no obstacle


def place_cells(upright: UprightScene, placing: Placing, options: PvsOptions) -> ViewCells:
    """Cells over the scene's plan, from the ground to the eyes of who stands on it.

    ``walkable``  squares on which one can stand somewhere, up to the eyes at the highest of these;
    ``grid`` all; ``triangles`` prisms that fill the free space between what stands there, no edge
    longer than a square's; ``floors`` what of squares can be stood on in rooms, on every floor.
    Raises :class:`OptionError` where there is no such place, and for more cells than ten million.
    """
    if placing == "floors":
        return _on_floors(upright, options)
    size = options.cell_size
    low, high = _plan(upright, options.eye_height)
    count = cells_across(high - low, size)
    columns, ground, free = _ground(upright, options.eye_height)
    if placing == "triangles":
        obstacles = _obstacles(upright, columns, ground, options)
        region = free_space(low, high, obstacles, size)
        plans = triangles_of(region, size)
    else:
        steps = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1)
        plans = low + size * (steps.reshape(-1, 1, 2) + np.array([[0.0, 0.0], [1.0, 1.0]]))
    kept, heights = [], []
    lows, highs = plans.min(axis=1), plans.max(axis=1)
    first, last = columns.cells_of(lows), columns.cells_of(highs)
    for cell, ((x0, y0), (x1, y1)) in enumerate(zip(first, last, strict=True)):
        there = slice(x0, x1 + 1), slice(y0, y1 + 1)
        if placing == "grid" or free[there].any():
            kept.append(cell)
            # Between house bases, ground is drawn that rises within houses: none stands there.
            stood = ground[there][free[there]] if placing == "walkable" else ground[there]
            heights.append([stood.min(), stood.max() + options.eye_height])
    if not kept:
        raise OptionError(
            "there is no place to stand on", where="cells",
            remedy="choose --cells grid, or another --eye-height or --up",
        )  # fmt: skip
    ground_low, eyes = np.array(heights).T
    # Cells are float32, and an eye at its full height must not be above its cell.
    ground_low, eyes = _double(rounded_down(ground_low)), _double(rounded_up(eyes))
    if placing == "triangles":
        return ViewCells.prisms(plans[kept], ground_low, eyes)
    return ViewCells.boxes(
        np.column_stack([lows[kept], ground_low]), np.column_stack([highs[kept], eyes])
    )


def _on_floors(upright: UprightScene, options: PvsOptions) -> ViewCells:
    """A box around each connected part of a floor in a square, from there to the eyes."""
    floors = floors_indoors(upright, options.eye_height)
    if floors is None:
        raise OptionError(
            "there is no floor in a room to stand on", where="cells",
            remedy="choose --cells walkable, or another --eye-height or --up",
        )  # fmt: skip
    low = floors.grid.to_world(floors.cells.astype(np.float64))
    high = low + floors.grid.cell_size
    squares = np.floor(0.5 * (low + high)[:, :2] / options.cell_size)
    same = (squares[floors.pairs[:, 0]] == squares[floors.pairs[:, 1]]).all(axis=1)
    a, b = floors.pairs[same].T
    ways = sparse.coo_matrix((np.ones(len(a), np.bool_), (a, b)), (len(low), len(low)))
    count, part = sparse.csgraph.connected_components(ways, directed=False)
    lows, highs = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(lows, part, low)
    np.maximum.at(highs, part, high)
    highs[:, 2] += options.eye_height - floors.grid.cell_size
    return ViewCells.boxes(lows, highs)


def _obstacles(
    upright: UprightScene, columns: Columns, ground: FloatArray, options: PvsOptions
) -> list[shapely.Geometry]:
    """The plans of what is in a walker's way.

    Of what is solid from the ground up that is its base.  Of anything else it is the hull, unless
    this is most of the scene: then it is rather the ground, or a whole town, and hides nothing.
    """
    low, high = upright.boxes[:, 0], upright.boxes[:, 1]
    first, last = columns.cells_of(low), columns.cells_of(high)
    below, above = _KERB * options.eye_height, _HEADROOM * options.eye_height
    plans, solid = plans_of(upright, options.ground)
    most = _MOST_OPEN * float(np.prod(upright.extent[:2]))
    kept = []
    for index, ((x0, y0), (x1, y1)) in enumerate(zip(first, last, strict=True)):
        there = ground[x0 : x1 + 1, y0 : y1 + 1]
        blocks = low[index, 2] < there.max() + above and high[index, 2] > there.max() + below
        if blocks and (solid[index] or plans[index].area <= most):
            kept.append(plans[index])
    return kept


def cells_across(extent: FloatArray, size: float, sliver: float = 1e-9) -> NDArray[np.int64]:
    """(2,) how many cells cover a plan (2,); what is left of a size is no cell if it is so little.

    Raises :class:`OptionError` for more than ten million.
    """
    count = np.maximum(np.ceil(extent / size - sliver), 1.0)
    if count.prod() > _MOST_CELLS:
        raise OptionError(
            f"{size:g} would make {int(count.prod()):,} cells", where="cell size",
            remedy=f"choose {size * float((count.prod() / _MOST_CELLS) ** 0.5):.3g} or more",
        )  # fmt: skip
    return np.asarray(count.astype(np.int64))


def _double(values: NDArray[np.float32]) -> FloatArray:
    return values.astype(np.float64)


def _plan(upright: UprightScene, eye: float) -> tuple[FloatArray, FloatArray]:
    """The corners (2,) of the plan that cells cover: as far around as walks lead."""
    around = AROUND * eye
    return np.full(2, -around), upright.extent[:2] + around


def _ground(upright: UprightScene, eye: float) -> tuple[Columns, FloatArray, BoolArray]:
    """Heights of the ground over the plan of the cells, and where one can stand."""
    low, high = _plan(upright, eye)
    finest = max(float((high - low).max()) / _MOST_COLUMNS, _FINEST * eye)
    columns = columns_of(upright, low, high, finest)
    ground, _ = ground_heights(columns, float(np.prod(upright.extent[:2])), eye)
    blocked = blocked_band(upright, columns, ground + _KERB * eye, ground + _HEADROOM * eye)
    return columns, ground, ~blocked & ~steep(ground, columns.cell)


def load_cells(path: Path, up: Axis, origin: FloatArray) -> ViewCells:
    """Cells of a JSON file, ``{"cells": [...]}``, in world coordinates: boxes
    ``{"low": [x, y, z], "high": [x, y, z]}`` and upright prisms ``{"corners": [[x, y], [x, y],
    [x, y]], "low": z, "high": z}``, whose corners lack the coordinate along the up axis.

    Their coordinates become those of the upright scene.  Raises :class:`OptionError` for what
    is no such file or has a cell that holds nothing.
    """
    where = str(path)
    data = read_bytes(path, error=OptionError, remedy="name a file of view cells")
    axis = "xyz".index(up)
    try:
        cells = json.loads(data)["cells"]
        prism = np.array(["corners" in one for one in cells], dtype=np.bool_)
        points = [_prism(one, axis) if "corners" in one else _box(one) for one in cells]
    except (ValueError, TypeError, KeyError) as error:
        raise OptionError(
            f"these are no view cells ({type(error).__name__}: {error})", where=where,
            remedy='write {"cells": [{"low": [x, y, z], "high": [x, y, z]}]}, or a prism as'
            ' {"corners": [[x, y], [x, y], [x, y]], "low": z, "high": z}',
        ) from None  # fmt: skip
    if len(cells) == 0:
        raise OptionError("it has no cells", where=where, remedy="give it one or more")
    upright = np.array(points)[:, :, axis_order(up)] - origin
    _check_filled(upright, prism, where)
    boxes = ViewCells.boxes(upright[~prism, 0], upright[~prism, 1])
    prisms = _prisms(upright[prism])
    # Boxes come first of both; the order of the file is wanted.
    places = np.argsort(np.argsort(prism, kind="stable"), kind="stable")
    return ViewCells.joined(boxes, prisms).some(places)


def _prisms(points: FloatArray) -> ViewCells:
    """From the points (n, 4, 3) of :func:`_prism`."""
    return ViewCells.prisms(points[:, :3, :2], points[:, 0, 2], points[:, 3, 2])


def _check_filled(upright: FloatArray, prism: BoolArray, where: str) -> None:
    """Raise :class:`OptionError` that names the first cell of the file that holds nothing."""
    try:
        ViewCells.boxes(upright[~prism, 0], upright[~prism, 1])
        _prisms(upright[prism])
    except OptionError:
        for index, points in enumerate(upright):
            try:
                _prisms(points[None]) if prism[index] else ViewCells.boxes(points[:1], points[1:2])
            except OptionError:
                raise OptionError(
                    f"cell {index} holds nothing", where=where,
                    remedy="give each cell a low height below its high one, and an area",
                ) from None  # fmt: skip


def _box(one: Any) -> list[list[float]]:
    low, high = _point(one["low"], 3), _point(one["high"], 3)
    return [low, high, high, high]


def _prism(one: Any, axis: int) -> list[list[float]]:
    """Three corners at the lower height, and one at the upper."""
    corners = [_point(corner, 2) for corner in one["corners"]]
    if len(corners) != 3:
        raise ValueError(f"{one['corners']} is not a triangle")
    (low,), (high,) = _point([one["low"]], 1), _point([one["high"]], 1)
    places = [(*corners, corners[0])[index] for index in range(4)]
    heights = [low, low, low, high]
    return [
        [*place[:axis], height, *place[axis:]]
        for place, height in zip(places, heights, strict=True)
    ]


def _point(values: Any, count: int) -> list[float]:
    point = [float(value) for value in values]
    if len(point) != count or not np.isfinite(point).all():
        raise ValueError(f"{values} is not a point of {count} numbers")
    return point
