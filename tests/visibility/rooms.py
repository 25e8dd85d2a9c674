"""Boxes that make up rooms, and what one certainly sees among them, by dense sampling."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import find_pvs
from simplifier.visibility.slices.shafts import Shafts, Targets, see_by_shafts
from simplifier.visibility.slices.slices import Grid, slices_of
from tests.solids import box
from tests.visibility.sheets import scene_of as scene_of_sheets

CELL = 0.25


def scene_of(boxes):
    """``boxes``: by name low and high corner."""
    return scene_of_boxes(np.array(list(boxes.values()), dtype=np.float64), list(boxes))


def two_rooms(door=1.0):
    """Rooms of 4 x 4 x 3 beside each other; the door is in the middle of the wall between them."""
    low, high = 2.0 - 0.5 * door, 2.0 + 0.5 * door
    return {
        "floor": ((-0.5, -0.5, -0.5), (9.0, 4.5, 0.0)),
        "ceiling": ((-0.5, -0.5, 3.0), (9.0, 4.5, 3.5)),
        "west": ((-0.5, -0.5, 0.0), (0.0, 4.5, 3.0)),
        "east": ((8.5, -0.5, 0.0), (9.0, 4.5, 3.0)),
        "south": ((0.0, -0.5, 0.0), (8.5, 0.0, 3.0)),
        "north": ((0.0, 4.0, 0.0), (8.5, 4.5, 3.0)),
        "wall a": ((4.0, 0.0, 0.0), (4.5, low, 3.0)),
        "wall b": ((4.0, high, 0.0), (4.5, 4.0, 3.0)),
        "lamp": ((7.0, 1.8, 1.0), (7.2, 2.2, 1.4)),
        "chest": ((5.0, 0.2, 0.2), (5.6, 0.6, 0.6)),
        "tree": ((12.0, 1.0, 0.0), (13.0, 2.0, 4.0)),
    }


def bent_hall(base=0.0):
    """A hall around a corner that is one closed sheet, what is in it, and a tree outside."""
    plan = [[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [4.0, 4.0], [4.0, 10.0], [0.0, 10.0]]
    points = [[*at, z] for z in (base, base + 3.0) for at in plan]
    caps = [[0, k, k + 1] for k in range(1, 5)]
    faces = [face for a, b, c in caps for face in ((a, b, c), (a + 6, c + 6, b + 6))]
    for k in range(6):
        after = (k + 1) % 6
        faces += [[k, after, after + 6], [k, after + 6, k + 6]]
    hall = TriangleMesh.from_soup(np.array(points), np.array(faces))
    lamp = box((0.4, 0.4, 0.4), (8.0, 1.5, base + 2.0))
    chest = box((0.6, 0.8, 0.5), (1.0, 8.5, base))
    tree = box((1.0, 1.0, 4.0), (14.0, 1.0, 0.0))
    return scene_of_sheets({"hall": hall, "lamp": lamp, "chest": chest, "tree": tree})


def slits(seed):
    """A wall with narrow slits, low and high, and thin posts some way behind them."""
    random = np.random.default_rng(seed)
    boxes = two_rooms(0.0)
    del boxes["wall a"], boxes["wall b"]
    ends = [0.0, *np.sort(random.choice(np.arange(1, 19), 4, replace=False)) * 0.2, 4.0]
    for number, (begin, end) in enumerate(pairwise(ends)):
        boxes[f"piece {number}"] = (
            (4.0, begin + 0.05, 0.0),
            (4.5, max(end - 0.05, begin + 0.1), 3.0),
        )
    boxes["bar"] = ((4.1, 0.0, 0.6), (4.4, 4.0, 2.4))
    for number in range(8):
        x, y = random.uniform(5.0, 8.0), random.uniform(0.1, 3.7)
        z = random.choice([0.1, 2.5])
        boxes[f"post {number}"] = ((x, y, z), (x + 0.1, y + 0.1, z + 0.3))
    return boxes


def cell(low, high):
    return ViewCells.boxes(np.array([low], dtype=np.float64), np.array([high], dtype=np.float64))


OUTSIDE = cell((-10.0, -10.0, 0.0), (-9.0, -9.0, 1.7))
"""Viewers on the ground that are in nothing."""


def shafts_of(scene, size=CELL, viewers=OUTSIDE):
    """Everything but the cells; upright space begins at the scene's low corner."""
    upright = UprightScene.of(scene, "z")
    grid = Grid.around(upright, size)
    return upright, Shafts.of(slices_of(upright, grid, viewers), Targets.of(upright, grid))


def seen_names(boxes, place, size=CELL):
    """The set of one cell (low, high) in world coordinates."""
    scene = scene_of(boxes)
    upright, shafts = shafts_of(scene, size)
    low, high = (np.array(corner) - upright.origin for corner in place)
    seen, _ = see_by_shafts(shafts, cell(low, high))
    return {name for name, visible in zip(scene.names, seen[0], strict=True) if visible}


def found_names(boxes, place, **options):
    """The same by the way that users take."""
    scene = scene_of(boxes)
    upright = UprightScene.of(scene, "z")
    low, high = (np.array(corner) - upright.origin for corner in place)
    options = {"epsilon": 5.0 * CELL, **options}
    chosen = PvsOptions(up="z", method="slice-wise", **options)
    pvs = find_pvs(upright, cell(low, high), chosen).pvs
    return {name for name, seen in zip(scene.names, pvs.visible(0), strict=True) if seen}


def sampled_names(boxes, place, count, random):
    """The objects that some of ``count`` lines from free points of a cell certainly reach."""
    corners = np.array(list(boxes.values()))
    names = list(boxes)
    eyes = random.uniform(*place, (count, 3))
    within = ((eyes[:, None] >= corners[:, 0]) & (eyes[:, None] <= corners[:, 1])).all(axis=2)
    eyes = eyes[~within.any(axis=1)]
    which = random.integers(0, len(names), len(eyes))
    ends = random.uniform(corners[which, 0], corners[which, 1])
    side, axis = random.integers(0, 2, len(eyes)), random.integers(0, 3, len(eyes))
    ends[np.arange(len(eyes)), axis] = corners[which, side, axis]
    towards = ends - eyes
    with np.errstate(divide="ignore", invalid="ignore"):
        spans = (corners[:, :, None] - eyes) / towards  # (n, 2, k, 3)
    near, far = np.nanmax(spans.min(axis=1), axis=2), np.nanmin(spans.max(axis=1), axis=2)
    hit = (np.maximum(near, 0.0) < np.minimum(far, 1.0 - 1e-9)).any(axis=0)
    return {names[index] for index in which[~hit]}
