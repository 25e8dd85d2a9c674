"""What slices save of the triangles of visible buildings, and what they take in files.

Buildings of the generated city are boxes.  Each stands here for one of 5,290 triangles, as large
as those of Yilmaz and Gudukbay (2007), section 5: its walls and its roof are grids of 23 x 23
squares.  Lines of such a grid are on none between eight slices, so that some triangles are in two.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.record import Row
from bench.visibility_city import streets
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import SLICES, Pvs
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_file import encode_pvs
from simplifier.io.scene import load_scene
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.checking.hidden_parts import hidden_boxes
from simplifier.visibility.find import Found, Watch, find_pvs
from simplifier.visibility.placing.cells import place_cells

LYON = Path("../shared/assets/city_lyon_buildings.glb")
_LYON_CELLS = 60  # by lot

SQUARES = 23  # along each side of a wall and of a roof

OCTREE_BITS = 0.75 * sum(8**level for level in range(1, 4))
"""Of a building: the paper counts a bit a node down to the size of slices, less a quarter."""


def slices_rows(
    blocks: int = 45, cells: int = 300, epsilons: Sequence[float] = (5.0, 2.5), checked: int = 50
) -> Iterator[Row]:
    """A row an epsilon: triangles that are drawn by wholes and by slices, times, bytes, leaks.

    ``checked`` of the cells are looked at for what hidden slices show.
    """
    upright, places = streets(blocks, cells)
    triangles = triangle_boxes()
    for epsilon in epsilons:
        plain, plain_seconds = _timed(upright, places, PvsOptions(up="z", epsilon=epsilon))
        options = PvsOptions(up="z", epsilon=epsilon, slices=True)
        found, seconds = _timed(upright, places, options)
        pvs, count = found.pvs, len(places)
        assert pvs.slices is not None
        values = pvs.slices.values
        drawn = triangles_drawn(values, triangles)
        plan = (values[:, :2] != 0).any(axis=1)
        check = check_pvs(upright.scene, pvs, CheckOptions(checked, 60))
        yield {
            "epsilon": epsilon,
            "cells": count,
            "objects": len(upright.scene),
            "visible": len(values) / count,
            "partly": (values != 0).any(axis=1).mean(),
            "floors_alone": (~plan & (values[:, 2] != 0)).mean(),
            "triangles_whole": len(values) * len(triangles) / count,
            "triangles_sliced": drawn.sum() / count,
            "drawn": drawn.sum() / (len(values) * len(triangles)),
            "ms_a_cell": 1e3 * found.seconds,
            "processor_ms_a_cell": 1e3 * seconds / count,
            "without": 1e3 * plain_seconds / count,
            "bytes_a_cell": _size(pvs) / count,
            "without_slices": _size(plain.pvs) / count,
            "octree_bytes": len(values) * OCTREE_BITS / 8.0 / count,
            "triangle_bytes": drawn.sum() / 8.0 / count,
            "leaks": len(check.leaks),
        }


def slices_table() -> Iterator[Row]:
    """The rows of the generated city, and one of a shared scene, by its own triangles."""
    for row in slices_rows():
        yield {"scene": "generated city", **row}
    upright = UprightScene.of(load_scene(LYON), "z")
    options = PvsOptions(up="z", ground=True, epsilon=5.0, slices=True, skip_buried=True)
    places = place_cells(upright, "walkable", options)
    lots = np.random.default_rng(0).permutation(len(places))[:_LYON_CELLS]
    yield {"scene": LYON.name, **scene_slices_row(upright, places.some(np.sort(lots)), options)}


def scene_slices_row(
    upright: UprightScene, places: ViewCells, options: PvsOptions, checked: int = 10
) -> Row:
    """What sets of a scene take with its own triangles, as the rows of the generated city have it.

    The options are those of cull maps with slices.  ``checked`` of the cells are looked at.
    """
    found, seconds = _timed(upright, places, options)
    pvs, count = found.pvs, len(places)
    whole, drawn = scene_triangles(upright, pvs)
    assert pvs.slices is not None
    pairs = len(pvs.slices.values)
    check = check_pvs(upright.scene, pvs, CheckOptions(checked, 60))
    return {
        "epsilon": options.reach,
        "cells": count,
        "objects": len(upright.scene),
        "visible": pairs / count,
        "triangles_whole": whole / count,
        "triangles_sliced": drawn / count,
        "drawn": drawn / whole,
        "processor_ms_a_cell": 1e3 * seconds / count,
        "bytes_a_cell": _size(pvs) / count,
        "octree_bytes": pairs * OCTREE_BITS / 8.0 / count,
        "triangle_bytes": drawn / 8.0 / count,
        "leaks": len(check.leaks),
    }


def scene_triangles(upright: UprightScene, pvs: Pvs) -> tuple[int, int]:
    """How many triangles all cells together draw: of whole objects, and in slices that are drawn.

    All cells are computed, with slices.
    """
    assert pvs.slices is not None
    seen = [np.flatnonzero(pvs.visible(cell)) for cell in range(len(pvs.cells))]
    objects = np.concatenate([np.empty(0, np.int64), *seen])
    whole = drawn = 0
    for index in np.unique(objects).tolist():
        mesh = upright.scene.joined([index])
        corners = (mesh.vertices[:, upright.order] - upright.origin)[mesh.faces]
        low, high = upright.boxes[index]
        unit = (corners - low) / np.maximum(high - low, 1e-300)
        boxes = np.stack([unit.min(axis=1), unit.max(axis=1)], axis=1)
        counts = triangles_drawn(pvs.slices.values[objects == index], boxes)
        whole += len(counts) * len(boxes)
        drawn += int(counts.sum())
    return whole, drawn


def _timed(upright: UprightScene, places: ViewCells, options: PvsOptions) -> tuple[Found, float]:
    """The sets, and the seconds of all cores for the cells."""
    clock: list[float] = []
    watch = Watch(lambda done, total: clock.append(time.process_time()))
    found = find_pvs(upright, places, options, None, watch)
    return found, clock[-1] - clock[0]


def _size(pvs: Pvs) -> int:
    return len(encode_pvs(pvs))


def triangle_boxes(squares: int = SQUARES) -> FloatArray:
    """(10 squares^2, 2, 3) the boxes of the triangles of a detailed building in the unit cube.

    Both triangles of a square have its box.
    """
    lines = np.arange(squares) / squares
    low = np.stack(np.meshgrid(lines, lines, indexing="ij"), axis=-1).reshape(-1, 2)
    high = low + 1.0 / squares
    boxes = []
    for axis, at in ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0), (2, 1.0)):
        ends = [np.insert(end, axis, at, axis=1) for end in (low, high)]
        boxes += [np.stack(ends, axis=1)] * 2
    return np.concatenate(boxes)


def triangles_drawn(values: NDArray[np.int8], triangles: FloatArray) -> NDArray[np.int64]:
    """(k,) how many of the triangles are in a slice that is drawn; ``values`` (k, 3)."""
    kinds, places = np.unique(values, axis=0, return_inverse=True)
    unit = np.tile(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), (len(kinds), 1, 1))
    hidden = hidden_boxes(unit, kinds, SLICES)
    counts = [
        np.count_nonzero(
            ~((triangles[:, 0] >= one[0] - 1e-9) & (triangles[:, 1] <= one[1] + 1e-9)).all(axis=1)
        )
        for one in hidden
    ]
    return np.array(counts, dtype=np.int64)[places.reshape(-1)]
