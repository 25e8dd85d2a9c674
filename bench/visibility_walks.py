"""Walks through scenes: triangles that are drawn by visible sets, by occluders, and by both."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.record import Row
from bench.visibility_city import generated_city
from simplifier.camera_paths.columns import UprightScene
from simplifier.camera_paths.generate import generate_path
from simplifier.culling.drawn import Way
from simplifier.culling.flythrough import fly
from simplifier.culling.visible_sets import VisibleSets
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import load_occluder_tree, occluder_store, write_manifest
from simplifier.options.scene import CullOptions, PathOptions, SceneOptions
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.cells import Placing, place_cells

_FRAMES = 600


def walk_rows(frames: int = _FRAMES, blocks: int = 6) -> Iterator[Row]:
    """A row a scene: means of a frame, shares of what the frustum alone leaves.

    Raises :class:`AssertionError` where sets and occluders together draw more than either.
    """
    options = PvsOptions(up="z", cell_size=10.0)
    path = PathOptions(kind="street", up="z", frames=frames)
    yield {
        "scene": f"city of {blocks} x {blocks} blocks",
        **_walk(generated_city(blocks), "walkable", options, path),
    }


def _walk(scene: Scene, placing: Placing, options: PvsOptions, walk: PathOptions) -> Row:
    built = SceneOptions(budget=12, resolution=16, moves=50, up="z", pixel_error=2.0)
    upright = UprightScene.of(scene, "z")
    path = generate_path(scene, walk)
    eyes = np.array([camera.position for camera in path.cameras])[:, upright.order]
    cells = place_cells(upright, placing, options)
    met = [cells.containing(eye - upright.origin) for eye in eyes]
    walked = cells.some(np.unique(np.concatenate(met)))  # the others are never looked up
    found = find_pvs(upright, walked, replace(options, skip_buried=True))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = build_occluders(scene, built, occluder_store(folder), {})
        write_manifest(folder, scene, built, made)
        tree = load_occluder_tree(folder)
    sets = VisibleSets.of(found.pvs, scene, scene)
    flown = fly(scene, tree, path, CullOptions((160, 90)), sets=sets)
    for frame in flown.frames:
        drawn = {way: frame.figures.drawn[way].triangles for way in Way}
        assert drawn[Way.BOTH] <= min(drawn[Way.PVS], drawn[Way.OCCLUDERS]), frame
        assert max(drawn[Way.PVS], drawn[Way.OCCLUDERS]) <= drawn[Way.FRUSTUM], frame
    total = flown.total
    whole = max(total.drawn[Way.FRUSTUM].triangles, 1)
    count = len(flown.frames)
    return {
        "frames": count,
        "cells": len(found.pvs.cells),
        "taken": " and ".join(found.way),
        "frustum": whole / count,
        **{way.value: total.drawn[way].triangles / count for way in list(Way)[1:]},
        **{f"{way.value}_share": total.drawn[way].triangles / whole for way in list(Way)[1:]},
        "frames_outside": sum(frame.figures.outside_cells for frame in flown.frames),
        "wrong_pixels_pvs": total.drawn[Way.PVS].wrong_pixels,
    }
