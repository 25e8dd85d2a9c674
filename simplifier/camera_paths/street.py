"""A walk at eye height over the ground, between what stands on it.

Heights of columns -> the ground that is walked on.

The ground is what is left of the lowest heights after a morphological opening, as in the filtering
of laser scans (K. Zhang et al., "A Progressive Morphological Filter for Removing Nonground
Measurements", 2003), with one window; where there is nothing, it is drawn from the bases nearby.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from simplifier.camera_paths.columns import Columns, UprightScene, blocked_band, columns_of, window
from simplifier.camera_paths.walk import Ids, Space, Ways, crossed_cells, equal_steps, smooth, tour
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

_MOST_COLUMNS = 1000  # along a window's side

AROUND = 5.0
"""Eye heights: how far from all objects a walk may lead."""

# In eye heights.
_FINEST, _COARSEST = 0.15, 0.6  # a column's edge
_KERB = 0.3  # lower things are walked over
_HEADROOM = 1.5
_AWAY = 0.35  # least distance from walls
_ROOMY = 2.0  # further from walls is not better
_BETWEEN = 5.0  # further from all that blocks is not between it
_UNDER_ROOF = 8.0  # how unwelcome a way under a roof is
_STEP = 8.0  # longest from frame to frame


@dataclass(frozen=True, eq=False)
class Street:
    """Where one can walk in the open.

    ``ground``    (nx, ny) float64 height; ``eye`` eye height.
    ``free``      (nx, ny) bool: nothing between kerb and headroom, and ground if there is any.
    ``walkable``  those of ``free`` that are far enough from all that is not.
    ``roofed``    (nx, ny) bool: something is above.
    ``distance``  (nx, ny) float64 to the nearest column that is not free.
    ``sights``    (nx, ny) bool: walkable, in the open, near what blocks.
    """

    columns: Columns
    eye: float
    ground: FloatArray
    free: BoolArray
    walkable: BoolArray
    roofed: BoolArray
    distance: FloatArray
    sights: BoolArray

    @property
    def space(self) -> Space:
        return Space(self._allows, self._clear)

    def _allows(self, points: FloatArray) -> BoolArray:
        x, y = self.columns.cells_of(points).T
        height = points[:, 2] - self.ground[x, y]
        level = (height > 0.7 * self.eye) & (height < 1.3 * self.eye)
        return np.asarray(self.walkable[x, y] & level)

    def _clear(self, starts: FloatArray, ends: FloatArray) -> BoolArray:
        starts, ends = self.columns.in_cells(starts), self.columns.in_cells(ends)
        return np.array([self._passes(a, b) for a, b in zip(starts, ends, strict=True)], np.bool_)

    def _passes(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether a segment keeps to the free band of all columns that it passes."""
        cells, spans = crossed_cells(start[:2], end[:2])
        if (cells < 0).any() or (cells >= self.free.shape).any():
            return False
        x, y = cells.T
        heights = start[2] + spans * (end[2] - start[2]) - self.ground[x, y][:, None]
        level = (heights > _KERB * self.eye) & (heights < _HEADROOM * self.eye)
        return bool(self.free[x, y].all() and level.all())


def street_walk(
    upright: UprightScene, frames: int, eye: float, rng: np.random.Generator
) -> FloatArray | None:
    """(frames, 3) eyes along a walk, upright space; None where one cannot walk."""
    street = find_street(upright, eye)
    if not street.sights.any():
        return None
    cells = np.argwhere(street.walkable)
    ways = _ways(street, cells)
    sights = street.sights[tuple(cells.T)]
    part = ways.parts()
    size = np.bincount(part, weights=sights)
    sights &= part == size.argmax()
    route = tour(ways, sights, 0.4 * _STEP * eye * frames, rng)
    route = smooth(route, street.space)
    return equal_steps(route, frames, _STEP * eye, street.space)


def find_street(upright: UprightScene, eye: float) -> Street:
    """The ground of the most built-up part of a scene, and where one can walk on it."""
    low, high = window(upright, _MOST_COLUMNS * _COARSEST * eye)
    margin = AROUND * eye
    low, high = low - margin, high + margin
    cell = max(float((high - low).max()) / _MOST_COLUMNS, _FINEST * eye)
    columns = columns_of(upright, low, high, cell)
    ground, surface = ground_heights(columns, float(np.prod(high - low - 2.0 * margin)), eye)
    blocked = blocked_band(upright, columns, ground + _KERB * eye, ground + _HEADROOM * eye)
    free = ~blocked & ~steep(ground, cell)
    if surface.any():
        free &= surface
    distance = _distances(~free, cell)
    walkable = free & (distance > max(_AWAY * eye, 1.5 * cell))
    roofed = columns.highs > ground + _HEADROOM * eye
    sights = walkable & ~roofed
    near = sights & (_distances(blocked, cell) < _BETWEEN * eye)
    sights = near if near.any() else sights
    return Street(columns, eye, ground, free, walkable, roofed, distance, sights)


def _distances(marked: BoolArray, cell: float) -> FloatArray:
    """(nx, ny) to the nearest marked column; infinite where there is none."""
    if not marked.any():
        return np.full(marked.shape, np.inf)
    return np.asarray(cell * ndimage.distance_transform_edt(~marked))


def _ways(street: Street, cells: Ids) -> Ways:
    """Between walkable columns that share an edge or a corner."""
    x, y = cells.T
    eyes = street.ground[x, y] + street.eye
    places = np.column_stack([street.columns.centres(cells), eyes])
    numbers = np.full(street.free.shape, -1, dtype=np.int64)
    numbers[x, y] = np.arange(len(cells))
    padded = np.pad(numbers, 1, constant_values=-1)
    pairs = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        others = padded[x + 1 + dx, y + 1 + dy]
        pairs.append(np.column_stack([np.arange(len(cells)), others])[others >= 0])
    crowded = np.maximum(0.0, 1.0 - street.distance[x, y] / (_ROOMY * street.eye))
    factors = 1.0 + 3.0 * crowded + (_UNDER_ROOF - 1.0) * street.roofed[x, y]
    return Ways.between(places, np.concatenate(pairs), factors)


AROUND = 5.0
"""Eye heights: how far from all objects a walk may lead."""

# In eye heights.
_BUMP = 12.0  # what is no wider than twice this is no hill
_UNEVEN = 1.0  # bases and floors this high above the lowest nearby still stand on the ground
_THICK = 2.0  # the ground may be a slab
_SMOOTH = 2.0  # over how far drawn ground is evened out

_SHARE = 0.1  # of the scene that one surface must have to be its ground


def ground_heights(columns: Columns, area: float, eye: float) -> tuple[FloatArray, BoolArray]:
    """(nx, ny) float64 height of the ground, and bool: whether it is a surface of the scene.

    ``area`` of the scene, seen from above.  Where the scene has a ground, bool is true on it; else
    it is true nowhere and the heights are those of the bases.
    """
    filled = columns.filled
    opened = _open_heights(columns.lows, int(np.ceil(_BUMP * eye / columns.cell)))
    based = filled & (columns.lows <= opened + _UNEVEN * eye)
    low = based & (columns.highs <= columns.lows + _THICK * eye)
    surface = _wide(low & ~steep(columns.highs, columns.cell), _SHARE * area / columns.cell**2)
    if surface.any():
        based, known = surface, columns.highs
    else:
        known = columns.lows
    nearest = ndimage.distance_transform_edt(~based, return_distances=False, return_indices=True)
    drawn = ndimage.gaussian_filter(known[tuple(nearest)], _SMOOTH * eye / columns.cell)
    return np.where(surface, columns.highs, drawn), surface


def steep(heights: FloatArray, cell: float) -> BoolArray:
    """(nx, ny) steeper than 45 degrees to one of the four neighbours."""
    result = np.zeros(heights.shape, dtype=np.bool_)
    with np.errstate(invalid="ignore"):  # two empty columns side by side
        for axis in (0, 1):
            step = ~(np.abs(np.diff(heights, axis=axis)) <= cell)
            before = (slice(None),) * axis + (slice(None, -1),)
            after = (slice(None),) * axis + (slice(1, None),)
            result[before] |= step
            result[after] |= step
    return result


def _open_heights(lows: FloatArray, reach: int) -> FloatArray:
    """What is left of the heights when bumps up to 2 ``reach`` + 1 wide are cut off; gaps are none.

    A slope loses the last ``reach`` of its upper end at the grid's edge, which costs a strip to
    walk on; windows about places outside would keep it, and with it eaves that hang over the edge.
    """
    size = 2 * reach + 1
    eroded = ndimage.minimum_filter(lows, size, mode="nearest")
    eroded[np.isinf(eroded)] = -np.inf
    return np.asarray(ndimage.maximum_filter(eroded, size, mode="nearest"))


def _wide(surface: BoolArray, least: float) -> BoolArray:
    """The connected parts of at least so many columns."""
    labels, _ = ndimage.label(surface)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray((sizes >= max(least, 1.0))[labels])
