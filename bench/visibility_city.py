"""A generated city to find visibility in: blocks of touching buildings between streets.

It has the size of the city of Wonka, Wimmer and Schmalstieg, *Visibility Preprocessing with
Occluder Fusion for Urban Walkthroughs* (2000): about 2,000 blocks.  Cells lie in its streets.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells

PITCH = 58.0  # metres from the middle of a street to that of the next
STREETS = (12.0, 20.0)  # width; it changes from block to block, or one would see along all of them
PARKS = 0.03  # share of the blocks that nothing stands on
ROOFS = (11.0, 27.0)
TOWERS = 0.01  # share of the buildings
TOWER_ROOFS = (40.0, 90.0)
MOST = 9  # buildings a block
LEAST = 4
_MORE = 0.4  # the share that brings the mean to 6

_STEP = 64.0  # parts of a metre: such coordinates are the same in float32 and under instancing
_TRIES = 1000  # places for each cell that is asked for

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
_SIDES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


def generated_city(blocks: int = 45, seed: int = 0) -> Scene:
    """``blocks`` x ``blocks`` blocks, less the parks, of 4 to 9 buildings each.

    Metres, +z up, the ground at z = 0; the middles of streets are at multiples of the pitch.
    Buildings are closed boxes; those of a block touch, and the walls that they share have equal
    coordinates.  The same arguments give the same scene.
    """
    generator = np.random.default_rng(seed)
    plans: list[FloatArray] = []
    names: list[str] = []
    for x in range(blocks):
        for y in range(blocks):
            count = LEAST + int(generator.binomial(MOST - LEAST, _MORE))
            if generator.random() < PARKS:
                continue
            low, high = 0.5 * generator.uniform(*STREETS, (2, 2))
            corner = PITCH * np.array([x, y])
            plan = _rounded(np.array([corner + low, corner + PITCH - high]))
            plans += _parted(plan, count, generator)
            names += [f"block {x} {y} building {index}" for index in range(count)]
    roofs = generator.uniform(*ROOFS, len(plans))
    tall = generator.random(len(plans)) < TOWERS
    roofs[tall] = generator.uniform(*TOWER_ROOFS, np.count_nonzero(tall))
    corners = np.zeros((len(plans), 2, 3))
    corners[:, :, :2] = np.array(plans).reshape(-1, 2, 2)
    corners[:, 1, 2] = _rounded(roofs)
    return scene_of_boxes(corners, names)


def _parted(plan: FloatArray, count: int, generator: Generator) -> list[FloatArray]:
    """A rectangle (2, 2) in so many, by cuts across the longer side."""
    if count == 1:
        return [plan]
    first = count // 2
    axis = int(np.argmax(plan[1] - plan[0]))
    share = first / count + generator.uniform(-0.08, 0.08)
    cut = _rounded(plan[0, axis] + share * (plan[1, axis] - plan[0, axis]))
    below, above = plan.copy(), plan.copy()
    below[1, axis] = above[0, axis] = cut
    return [*_parted(below, first, generator), *_parted(above, count - first, generator)]


def scene_of_boxes(boxes: FloatArray, names: Sequence[str]) -> Scene:
    """Closed boxes (n, 2, 3) from low to high corner, wound outwards, as instances of one mesh."""
    triangles = np.concatenate([_SIDES[:, [0, 1, 2]], _SIDES[:, [0, 2, 3]]])
    transforms = np.tile(np.eye(4), (len(boxes), 1, 1))
    transforms[:, [0, 1, 2], [0, 1, 2]] = boxes[:, 1] - boxes[:, 0]
    transforms[:, :3, 3] = boxes[:, 0]
    unit = TriangleMesh.from_soup(_CORNERS, triangles)
    return Scene((unit,), tuple(names), np.zeros(len(boxes), dtype=np.int32), transforms)


def street_cells(
    city: Scene, count: int, size: float = 10.0, eye: float = 2.0, seed: int = 0
) -> ViewCells:
    """Boxes of ``size`` x ``size`` x ``eye`` on the ground between blocks of a generated city.

    They touch no building, so they lie where streets are wider.  Their coordinates are those
    of the world.  Raises :class:`ValueError` where there are hardly any such places.
    """
    generator = np.random.default_rng(seed)
    bounds = city.bounds()
    plans = bounds[:, :, :2]
    lines = np.ceil(plans[:, 1].max(axis=0) / PITCH)  # streets between blocks, and one more
    slack = max(0.5 * (STREETS[1] - size), 0.0)
    kept: list[FloatArray] = []
    for _ in range(_TRIES * count):
        if len(kept) == count:
            break
        across = int(generator.integers(2))
        middle = generator.uniform(0.0, lines * PITCH)
        line = generator.integers(1, lines[across])
        middle[across] = line * PITCH + generator.uniform(-slack, slack)
        low = _rounded(middle - 0.5 * size)
        touched = (plans[:, 0] <= low + size).all(axis=1) & (plans[:, 1] >= low).all(axis=1)
        if not touched.any():
            kept.append(low)
    if len(kept) < count:
        raise ValueError(f"{count} cells of {size:g} m: the streets are too narrow")
    low = np.column_stack([np.array(kept).reshape(-1, 2), np.zeros(count)])
    return ViewCells.boxes(low, low + np.array([size, size, eye]))


def streets(blocks: int, count: int, size: float = 10.0) -> tuple[UprightScene, ViewCells]:
    """A generated city, and cells in its streets in the space of its origin."""
    city = generated_city(blocks)
    upright = UprightScene.of(city, "z")
    cells = street_cells(city, count, size)
    return upright, ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)


def _rounded(values: FloatArray) -> FloatArray:
    return np.asarray(np.round(np.asarray(values) * _STEP) / _STEP)
