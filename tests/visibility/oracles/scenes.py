"""Two small scenes of boxes in three dimensions, whose walls lie on a grid of voxels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.visibility.rooms import two_rooms

Corners = tuple[tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class Small:
    """``boxes`` by name low and high corner; ``cells`` likewise; ``voxel`` what the walls fit."""

    boxes: dict[str, Corners]
    cells: tuple[Corners, ...]
    voxel: float = 0.5


def rooms() -> Small:
    """Two rooms with a door between them."""
    west, east = ((0.5, 0.5, 0.25), (1.5, 1.5, 1.75)), ((5.25, 2.5, 0.25), (6.25, 3.5, 1.75))
    return Small(two_rooms(), (west, east))


def staggered() -> Small:
    """Two walls that hide a house together alone, below a bridge over which one sees a tower."""
    boxes = {
        "floor": ((-3.0, -6.0, -1.0), (12.0, 6.0, 0.0)),
        "right": ((3.0, -6.0, 0.0), (4.0, 1.0, 4.0)),
        "left": ((5.0, 0.0, 0.0), (6.0, 6.0, 4.0)),
        "bridge": ((3.0, -6.0, 4.0), (6.0, 6.0, 5.0)),
        "house": ((9.0, -0.5, 0.0), (10.0, 2.0, 2.0)),
        "tower": ((10.0, 3.0, 0.0), (11.0, 4.0, 14.0)),
        "sign": ((1.5, 3.0, 2.5), (2.0, 4.0, 3.5)),
        "lamp": ((4.25, 0.1, 3.25), (4.5, 0.3, 3.5)),
    }
    before, aside = ((-1.5, -0.5, 0.25), (-0.5, 0.5, 1.75)), ((-3.0, 2.0, 0.25), (-2.0, 3.0, 1.75))
    return Small(boxes, (before, aside), 1.0)


def dotted(small: Small, count: int, seed: int = 0) -> Small:
    """With so many boxes of a few centimetres by lot, of which sets tell how much space is open."""
    corners = np.array(list(small.boxes.values()))
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    places = np.random.default_rng(seed).uniform(low, high - 0.05, (count, 3))
    dots = {f"dot {k}": (tuple(at), tuple(at + 0.04)) for k, at in enumerate(places)}
    return Small({**small.boxes, **dots}, small.cells, small.voxel)


SCENES = {"two rooms": rooms, "staggered walls": staggered}
