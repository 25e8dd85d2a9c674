"""Scene -> heights over a grid of upright columns, and the part of it worth a visit.

Scene -> triangles with z up and the origin nearby, some objects at a time.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.scene import Scene, axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.columns import block_columns, raise_columns
from simplifier.options.simplify import Axis

_COARSE = 256  # columns along the longer side when a window is looked for


@dataclass(frozen=True, eq=False)
class Columns:
    """Square columns over a window of an upright scene.

    ``low``    (2,) float64: the window's low corner.
    ``cell``   edge of a column.
    ``lows``, ``highs``  (nx, ny) float64: lowest and highest point of each; infinite and minus
               infinite where it is empty.
    """

    low: FloatArray
    cell: float
    lows: FloatArray
    highs: FloatArray

    @property
    def filled(self) -> BoolArray:
        """(nx, ny) whether there is anything in the column."""
        return np.asarray(np.isfinite(self.lows))

    def in_cells(self, points: FloatArray) -> FloatArray:
        """Upright places (…, 2 or 3) to columns; a third coordinate stays."""
        result = np.array(points, dtype=np.float64, order="C")
        result[..., :2] = (result[..., :2] - self.low) / self.cell
        return result

    def cells_of(self, points: FloatArray) -> NDArray[np.int64]:
        """(n, 2) the columns of upright places, the nearest one outside of the grid."""
        cells = np.floor(self.in_cells(points)[:, :2]).astype(np.int64)
        return np.clip(cells, 0, np.array(self.lows.shape) - 1)

    def centres(self, cells: NDArray[np.int64]) -> FloatArray:
        """(n, 2) the middles of columns (n, 2), upright space."""
        return np.asarray((cells + 0.5) * self.cell + self.low)


def columns_of(upright: UprightScene, low: FloatArray, high: FloatArray, cell: float) -> Columns:
    """The heights of all triangles over the window from ``low`` to ``high`` (2,)."""
    shape = np.maximum(np.ceil((high - low) / cell - 1e-9).astype(np.int64), 1)
    columns = Columns(low, cell, np.full(tuple(shape), np.inf), np.full(tuple(shape), -np.inf))
    for vertices, faces in upright.triangles(*_over(low, high)):
        raise_columns(columns.in_cells(vertices), faces, columns.lows, columns.highs)
    return columns


def blocked_band(
    upright: UprightScene, columns: Columns, lows: FloatArray, highs: FloatArray
) -> BoolArray:
    """(nx, ny) the columns in which a triangle reaches into the heights ``lows`` to ``highs``."""
    blocked = np.zeros(columns.lows.shape, dtype=np.bool_)
    high = columns.low + np.array(blocked.shape) * columns.cell
    for vertices, faces in upright.triangles(*_over(columns.low, high)):
        block_columns(columns.in_cells(vertices), faces, lows, highs, blocked)
    return blocked


def window(upright: UprightScene, longest: float) -> tuple[FloatArray, FloatArray]:
    """(2,) low and high corner of the most built-up square of at most that edge."""
    extent = upright.extent[:2]
    sides = np.minimum(extent, longest)
    if (sides >= extent).all():
        return np.zeros(2), extent
    columns = columns_of(upright, np.zeros(2), extent, float(extent.max()) / _COARSE)
    relief = np.where(columns.filled, columns.highs - columns.lows, 0.0)
    size = np.maximum(np.round(sides / columns.cell).astype(np.int64), 1)
    # Steep land is not built up: only the share of columns that stand out counts.
    built = (relief > np.median(relief) + columns.cell).astype(np.float64)
    share = ndimage.uniform_filter(built, tuple(size), mode="constant")
    middle = columns.centres(np.argwhere(share == share.max())[:1])[0]
    low = np.clip(middle - sides / 2.0, 0.0, extent - sides)
    return low, low + sides


def _over(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The window as a box of any height."""
    return np.array([*low, -np.inf]), np.array([*high, np.inf])


_BATCH = 1 << 20  # triangles at once
_DOOR = re.compile(r"(?<![a-z])(ifc)?door(s|leaf)?(?![a-z])")


@dataclass(frozen=True, eq=False)
class UprightScene:
    """A scene, its boxes, and the way to its upright space.

    ``order``   (3,) int: which world axis is upright x, y, z; a rotation.
    ``origin``  (3,) float64: the box's low corner, in upright axes; map coordinates keep their
                digits this way.
    ``boxes``   (n, 2, 3) float64: of the objects, upright space.
    """

    scene: Scene
    order: IntArray
    origin: FloatArray
    boxes: FloatArray

    @classmethod
    def of(cls, scene: Scene, up: Axis) -> UprightScene:
        order = axis_order(up).astype(np.int32)
        boxes = scene.bounds()[:, :, order]
        origin = boxes[:, 0].min(axis=0)
        return cls(scene, order, origin, boxes - origin)

    @property
    def extent(self) -> FloatArray:
        """(3,) the high corner of the box around all."""
        return np.asarray(self.boxes[:, 1].max(axis=0))

    def to_world(self, points: FloatArray) -> FloatArray:
        """Upright places (n, 3) to the world."""
        return self.directions_to_world(points + self.origin)

    def directions_to_world(self, directions: FloatArray) -> FloatArray:
        """Upright directions (n, 3) to the world."""
        result = np.empty_like(directions)
        result[:, self.order] = directions
        return result

    def triangles(self, low: FloatArray, high: FloatArray) -> Iterator[tuple[FloatArray, IntArray]]:
        """Vertices and faces of the objects that reach into a box, in upright space."""
        inside = (self.boxes[:, 1] >= low).all(axis=1) & (self.boxes[:, 0] <= high).all(axis=1)
        objects = np.nonzero(inside)[0].astype(np.int32)
        if len(objects) == 0:
            return
        batch = np.cumsum(self.scene.triangle_counts[objects]) // _BATCH
        for some in np.split(objects, np.nonzero(np.diff(batch))[0] + 1):
            mesh = self.scene.joined(some)
            yield np.ascontiguousarray(mesh.vertices[:, self.order] - self.origin), mesh.faces

    def with_scene(self, scene: Scene) -> UprightScene:
        """Another scene in the same upright space."""
        boxes = scene.bounds()[:, :, self.order] - self.origin
        return replace(self, scene=scene, boxes=boxes)

    def without_doors(self) -> UprightScene:
        """All but the objects whose names say door: one may walk through them."""
        kept = np.array([not _is_door(name) for name in self.scene.names])
        return self if kept.all() or not kept.any() else self.some(kept)

    def some(self, kept: NDArray[np.bool_]) -> UprightScene:
        """Those of a mask (n,), in the same upright space."""
        return replace(self, scene=self.scene.some(kept), boxes=self.boxes[kept])


def _is_door(name: str) -> bool:
    return _DOOR.search(name.lower()) is not None
