"""Rooms: sets by slices in shared interiors, beside what pictures see in them."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.record import Row
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.io.scene import load_scene
from simplifier.options.simplify import Axis
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.cells import place_cells

ASSETS = Path("../shared/assets")
INTERIORS: tuple[tuple[str, Axis, float], ...] = (
    ("building_duplex.glb", "z", 0.2),
    ("level_dungeon.ply", "y", 1.0),
    ("sponza_dabrovic.glb", "y", 0.5),
)
"""File, up axis and epsilon."""

_TILE = 4.0  # edge of the parts that a scene of a single mesh is cut into
_PICTURES = 6  # in each cell that is checked


def rooms_rows(
    interiors: Sequence[tuple[str, Axis, float]] = INTERIORS, checked: int = 12, most: int = 400
) -> Iterator[Row]:
    """A row a scene; cells are drawn by lot where there are more than ``most``."""
    for name, up, epsilon in interiors:
        scene = load_scene(ASSETS / name)
        scene = tiles(scene) if len(scene) == 1 else scene
        upright = UprightScene.of(scene, up)
        options = PvsOptions(
            up=up, method="slice-wise", cell_size=1.0, epsilon=epsilon, eye_height=1.6
        )
        places = place_cells(upright, "floors", options)
        lots = np.sort(np.random.default_rng(0).permutation(len(places))[:most])
        begin, worked = time.perf_counter(), time.process_time()
        found = find_pvs(upright, places.some(lots), options)
        seconds, worked = time.perf_counter() - begin, time.process_time() - worked
        check = check_pvs(
            scene, found.pvs, CheckOptions(checked, 40, pictures=_PICTURES, pixels=256)
        )
        yield {
            "scene": name,
            "objects": len(scene),
            "all_cells": len(places),
            "cells": len(lots),
            "seconds": seconds,
            "processor_seconds": worked,
            "ms_a_cell": 1e3 * found.seconds,
            "sets_to_seen": check.excess,
            "culled": check.culled_share,
            "leaks": len(check.leaks),
        }


def tiles(scene: Scene) -> Scene:
    """A scene of one mesh in cubes, by the middles of its triangles."""
    mesh = scene.joined([0])
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    places = np.floor(middles / _TILE).astype(np.int64)
    _, which = np.unique(places, axis=0, return_inverse=True)
    parts = [
        TriangleMesh.from_soup(mesh.vertices, mesh.faces[which.reshape(-1) == part])
        for part in range(int(which.max()) + 1)
    ]
    count = len(parts)
    return Scene(
        tuple(parts), tuple(f"tile {part}" for part in range(count)),
        np.arange(count, dtype=np.int32), np.tile(np.eye(4), (count, 1, 1)),
    )  # fmt: skip
