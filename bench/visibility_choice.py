"""What ``occluder pvs --method auto`` takes of each scene, beside each method that can serve."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.record import Row
from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from bench.visibility_rooms import ASSETS, INTERIORS, tiles
from bench.visibility_strong import paper_cells, paper_city
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.elevation import load_elevation
from simplifier.io.scene import load_scene
from simplifier.options.visibility import Method, PvsOptions
from simplifier.visibility.find import METHODS, Found, find_pvs
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from simplifier.visibility.solid.terrain import Terrain

_EDGE = 800.0  # metres of a cell on the mountains


@dataclass(frozen=True, eq=False)
class Case:
    """A scene and cells in it, as ``occluder pvs`` would have them."""

    upright: UprightScene
    cells: ViewCells
    options: PvsOptions
    terrain: Terrain | None = None


def choice_rows(names: Sequence[str] | None = None, most: int = 60) -> Iterator[Row]:
    """A row a scene, of those that are named; at most so many cells of each, by lot.

    ``seconds`` are those of all processors, the scene made ready included; ``foretold`` and
    ``came`` are by the clock.  Methods that the scene is refused by have none.
    """
    for name, make in CASES.items():
        if names is not None and name not in names:
            continue
        case = make(most)
        found, seconds = _timed(case, "auto")
        foretold = found.foretold or found.cost
        row: dict[str, object] = {
            "scene": name,
            "objects": len(case.upright.scene),
            "cells": found.made,
            "taken": " and ".join(found.way),
            "sentence": found.reason,
            "foretold_ms_a_cell": 1e3 * foretold.seconds_a_cell,
            "came_ms_a_cell": 1e3 * found.cost.seconds_a_cell,
            "foretold_seconds": foretold.seconds,
            "came_seconds": found.cost.seconds,
            "auto_seconds": seconds,
            "auto_set": _mean_set(found),
        }
        for method in METHODS:
            try:
                by, took = _timed(case, method)
            except OptionError:
                continue
            row[f"{method}_seconds"], row[f"{method}_set"] = took, _mean_set(by)
        yield row


def _timed(case: Case, method: str) -> tuple[Found, float]:
    options = replace(case.options, method=_method(method))
    begin = time.process_time()
    found = find_pvs(case.upright, case.cells, options, terrain=case.terrain)
    return found, time.process_time() - begin


def _method(name: str) -> Method:
    return name  # type: ignore[return-value]


def _mean_set(found: Found) -> float:
    return float(np.mean([found.pvs.visible(cell).sum() for cell in found.pvs.computed.tolist()]))


def _some(cells: ViewCells, most: int) -> ViewCells:
    return cells.some(np.sort(np.random.default_rng(0).permutation(len(cells))[:most]))


def _city(blocks: int, most: int) -> Case:
    city = generated_city(blocks)
    return _placed(city, street_cells(city, most), PvsOptions(up="z"))


def _placed(scene: Scene, cells: ViewCells, options: PvsOptions) -> Case:
    upright = UprightScene.of(scene, "z")
    there = ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)
    return Case(upright, there, options)


def _lyon(most: int) -> Case:
    upright = UprightScene.of(load_scene(ASSETS / "city_lyon_buildings.glb"), "z")
    options = PvsOptions(up="z", ground=True, skip_buried=True)
    return Case(upright, _some(place_cells(upright, "walkable", options), most), options)


def _interior(place: int, most: int) -> Case:
    name, up, epsilon = INTERIORS[place]
    scene = load_scene(ASSETS / name)
    upright = UprightScene.of(tiles(scene) if len(scene) == 1 else scene, up)
    options = PvsOptions(up=up, cell_size=1.0, epsilon=epsilon, eye_height=1.6, skip_buried=True)
    return Case(upright, _some(place_cells(upright, "floors", options), most), options)


def _mountains(most: int) -> Case:
    posts = load_elevation(ASSETS / "dem_jacksboro_344x403_int16.npy", spacing=(74.40, 92.67))
    terrain = Terrain.of(posts, 16)
    upright = UprightScene.of(terrain.scene, "z")
    options = PvsOptions(up="z", cell_size=_EDGE, eye_height=2.0, skip_buried=True)
    cells = place_on_terrain(terrain, upright, "grid", options)
    return Case(upright, _some(cells, most), options, terrain)


def _boxes(most: int) -> Case:
    boxes = paper_city()
    scene = scene_of_boxes(boxes, [f"box {index}" for index in range(len(boxes))])
    options = PvsOptions(up="z", cell_size=20.0, eye_height=50.0)
    return _placed(scene, _some(paper_cells(20.0), most), options)


CASES: Mapping[str, Callable[[int], Case]] = {
    "city of 6 x 6 blocks": lambda most: _city(6, most),
    "city of 45 x 45 blocks": lambda most: _city(45, most),
    "Lyon": _lyon,
    "duplex": lambda most: _interior(0, most),
    "dungeon": lambda most: _interior(1, most),
    "Sponza": lambda most: _interior(2, most),
    "mountains": _mountains,
    "3,324 boxes": _boxes,
}
"""By name, of at most so many cells."""
