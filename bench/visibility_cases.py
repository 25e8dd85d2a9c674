"""Scenes of all kinds with view cells in them, for what is told of more than one method."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from bench.visibility_rooms import ASSETS, INTERIORS, tiles
from bench.visibility_strong import paper_cells, paper_city
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.elevation import load_elevation
from simplifier.io.scene import load_scene
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import Found, Watch, find_pvs
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.placing.terrain_cells import place_columns, place_on_terrain
from simplifier.visibility.solid.terrain import Terrain

_EDGE = 800.0  # metres of a cell on the mountains


@dataclass(frozen=True, eq=False)
class Case:
    """A scene and cells in it, as ``occluder pvs`` would have them."""

    upright: UprightScene
    cells: ViewCells
    options: PvsOptions
    terrain: Terrain | None = None

    def some(self, most: int) -> Case:
        """With at most so many of the cells, by lot."""
        lots = np.random.default_rng(0).permutation(len(self.cells))[:most]
        return replace(self, cells=self.cells.some(np.sort(lots)))


def cells_timed(
    upright: UprightScene, places: ViewCells, options: PvsOptions, terrain: Terrain | None = None
) -> tuple[Found, float]:
    """The sets, and the seconds of all cores for the cells, which do not count what others do."""
    clock: list[float] = []
    watch = Watch(lambda done, total: clock.append(time.process_time()))
    found = find_pvs(upright, places, options, None, watch, terrain=terrain)
    return found, clock[-1] - clock[0]


def city(blocks: int, cells: int = 60) -> Case:
    """So many cells by lot in the streets of a generated city."""
    scene = generated_city(blocks)
    return _placed(scene, street_cells(scene, cells), PvsOptions(up="z"))


def walkable_city(blocks: int, eye: float) -> Case:
    """All cells on which one can walk."""
    upright = UprightScene.of(generated_city(blocks), "z")
    options = PvsOptions(up="z", eye_height=eye, skip_buried=True)
    return Case(upright, place_cells(upright, "walkable", options), options)


def lyon(eye: float = 1.7) -> Case:
    upright = UprightScene.of(load_scene(ASSETS / "city_lyon_buildings.glb"), "z")
    options = PvsOptions(up="z", eye_height=eye, ground=True, skip_buried=True)
    return Case(upright, place_cells(upright, "walkable", options), options)


def interior(place: int, eye: float = 1.6) -> Case:
    """Of :data:`~bench.visibility_rooms.INTERIORS`."""
    name, up, epsilon = INTERIORS[place]
    scene = load_scene(ASSETS / name)
    upright = UprightScene.of(tiles(scene) if len(scene) == 1 else scene, up)
    options = PvsOptions(up=up, cell_size=1.0, epsilon=epsilon, eye_height=eye, skip_buried=True)
    return Case(upright, place_cells(upright, "floors", options), options)


def mountains(eye: float = 2.0, edge: float | None = _EDGE, share: float = 1.0) -> Case:
    """Cells of ``edge`` metres; without any they are the plans of the tiles.

    ``share``  of the posts along both axes, from the north-west.
    """
    posts = load_elevation(ASSETS / "dem_jacksboro_344x403_int16.npy", spacing=(74.40, 92.67))
    rows, columns = (int(share * length) for length in posts.heights.shape)
    terrain = Terrain.of(replace(posts, heights=posts.heights[:rows, :columns]), 16)
    upright = UprightScene.of(terrain.scene, "z")
    options = PvsOptions(up="z", cell_size=edge or _EDGE, eye_height=eye, skip_buried=True)
    place = place_columns if edge is None else place_on_terrain
    return Case(upright, place(terrain, upright, "grid", options), options, terrain)


def boxes() -> Case:
    corners = paper_city()
    scene = scene_of_boxes(corners, [f"box {index}" for index in range(len(corners))])
    options = PvsOptions(up="z", cell_size=20.0, eye_height=50.0)
    return _placed(scene, paper_cells(20.0), options)


def _placed(scene: Scene, cells: ViewCells, options: PvsOptions) -> Case:
    upright = UprightScene.of(scene, "z")
    there = ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)
    return Case(upright, there, options)


CASES: Mapping[str, Callable[[], Case]] = {
    "city of 6 x 6 blocks": lambda: city(6),
    "city of 45 x 45 blocks": lambda: city(45),
    "Lyon": lyon,
    "duplex": lambda: interior(0),
    "dungeon": lambda: interior(1),
    "Sponza": lambda: interior(2),
    # Sweeps are for all cells or none, and take the square of the posts: 17 s for all of them.
    "mountains, a quarter, cells of 800 m": lambda: mountains(share=0.5),
    "mountains, a quarter, cells of tiles": lambda: mountains(edge=None, share=0.5),
    "3,324 boxes": boxes,
}
"""By name."""
