"""A walk through rooms: over floors with headroom, under a roof or between walls."""

from __future__ import annotations

import numpy as np

from simplifier.camera_paths.floors import Floors, find_floors
from simplifier.camera_paths.routes import Ids, Ways, tour
from simplifier.camera_paths.upright import UprightScene
from simplifier.camera_paths.walk import Space, crossed_cells, smoothed, stepped
from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray

_AWAY = 0.12  # least distance from walls and ledges, eye heights
_ROOMY = 0.6  # further from them is not better
_AREA = 4.0  # the least floor, squares of eye heights
_OPEN_AREA = 0.05  # the least floor of rooms without a roof, share of the scene: else it is a yard
_OPEN = 0.25  # what a place between walls counts for, beside one under a roof
_STEP = 3.0  # longest from frame to frame, eye heights


def interior_walk(
    upright: UprightScene, frames: int, eye: float, rng: np.random.Generator
) -> FloatArray | None:
    """(frames, 3) eyes along a walk, upright space; None where there is no interior."""
    floors = find_floors(upright.without_doors(), eye)
    if floors is None or len(floors.pairs) == 0:
        return None
    ledges = floors.ledge_distances()
    roofed, rooms = floors.indoors()
    kept = rooms & (ledges >= max(_AWAY * floors.eye, 1.0))
    pairs = _renumbered(floors.pairs, kept)
    if len(pairs) == 0:
        return None
    crowded = np.maximum(0.0, 1.0 - ledges[kept] / (_ROOMY * floors.eye))
    ways = Ways.between(floors.eyes[kept], pairs, 1.0 + 3.0 * crowded)
    room = _largest(ways, np.where(roofed[kept], 1.0, _OPEN))
    if np.count_nonzero(room) < _least(floors, roofed[kept][room]):
        return None
    longest = _STEP * floors.eye
    route = tour(ways, room, 0.4 * longest * frames, rng)
    space = _space(floors, kept)
    return floors.grid.to_world(stepped(smoothed(route, space), frames, longest, space))


def _least(floors: Floors, roofed: BoolArray) -> float:
    """How many places make an interior."""
    least = _AREA * floors.eye**2
    width, depth, _ = floors.grid.shape
    return least if roofed.mean() > 0.5 else max(least, _OPEN_AREA * width * depth)


def _renumbered(pairs: Ids, kept: BoolArray) -> Ids:
    """The pairs of which both are kept, by their numbers among these."""
    numbers = np.cumsum(kept) - 1
    return np.asarray(numbers[pairs[kept[pairs].all(axis=1)]])


def _largest(ways: Ways, worth: FloatArray) -> BoolArray:
    """(n,) whether a place is in the connected part of the highest worth."""
    part = ways.parts()
    return np.asarray(part == np.bincount(part, weights=worth).argmax())


def _space(floors: Floors, kept: BoolArray) -> Space:
    """About the eyes of the places that are kept; grid space."""
    inside = floors.grid.inside
    about = np.zeros_like(inside)
    x, y, z = (index[kept] for index in floors.eye_voxels)
    for rise in (-1, 0, 1):
        about[x, y, np.clip(z + rise, 0, inside.shape[2] - 1)] = True
    about &= ~inside

    def allows(points: FloatArray) -> BoolArray:
        return np.asarray(about[tuple(points.astype(np.int64).T)])

    def clear(starts: FloatArray, ends: FloatArray) -> BoolArray:
        ways = [crossed_cells(a, b)[0] for a, b in zip(starts, ends, strict=True)]
        return np.array([not inside[tuple(way.T)].any() for way in ways], dtype=np.bool_)

    return Space(allows, clear)
