"""Terrain: voxel columns by sweeps and as published, beside lines from all over the columns."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.meshes import ASSETS
from bench.record import Row
from bench.voxel_columns import published_sets
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.elevation import load_elevation
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.terrain_view import terrain_seen_from
from simplifier.visibility.columns.sweep_posts import SweepPosts
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.terrain_cells import place_columns
from simplifier.visibility.solid.terrain import Terrain

JACKSBORO = ASSETS / "dem_jacksboro_344x403_int16.npy"
SPACING = (74.40, 92.67)
_INNER = 4  # posts between two viewpoints within a column; on its border it is one
_WITHIN = 1e-6  # of the terrain, by which viewpoints keep away from its border

Places = NDArray[np.int64]


@dataclass(frozen=True)
class Forms:
    """What is measured: ``sizes`` of sweeps in posts, the finest ``steps`` of the published form,
    and epsilons of cull maps in world units."""

    sizes: Sequence[int] = (1, 2, 4)
    steps: Sequence[int] = (1, 4)
    epsilons: Sequence[float] = (400.0,)


def terrain_rows(
    path: Path = JACKSBORO,
    tile: int = 16,
    eye: float = 2.0,
    checked: int = 40,
    azimuths: int = 720,
    forms: Forms | None = None,
) -> Iterator[Row]:
    """A row a form; ``checked`` columns by lot are held against lines all around, from each post of
    their borders and some within, an eye over their highest ground.
    """
    forms = forms or Forms()
    terrain = Terrain.of(load_elevation(path, spacing=SPACING), tile)
    upright = UprightScene.of(terrain.scene, "z")
    options = PvsOptions(up="z", method="voxel-column", eye_height=eye)
    cells = place_columns(terrain, upright, "grid", options)
    lots = np.sort(np.random.default_rng(0).permutation(len(cells))[:checked])
    seen = np.array([sampled(terrain, upright, cells, cell, azimuths) for cell in lots.tolist()])
    for size in forms.sizes:
        some = PvsOptions(
            up="z", method="voxel-column", eye_height=eye, epsilon=size * max(SPACING)
        )
        yield {"form": "sweeps", "posts": size, "sweeps": _sweeps(terrain, size),
               **_judged(terrain, upright, cells, some, lots, seen)}  # fmt: skip
    for step in forms.steps:
        yield {"form": "published", "posts": step,
               **_published(terrain, upright, cells, lots, seen, step)}  # fmt: skip
    for epsilon in forms.epsilons:
        some = PvsOptions(up="z", method="cull-map", epsilon=epsilon)
        yield {"form": "cull maps", "posts": epsilon / max(SPACING),
               **_judged(terrain, upright, cells, some, lots, seen)}  # fmt: skip


def sampled(
    terrain: Terrain, upright: UprightScene, cells: ViewCells, cell: int, azimuths: int
) -> BoolArray:
    """(n,) what exact lines from the top of a column see."""
    spacing = np.array(terrain.elevation.spacing)
    first = terrain.corner - upright.origin[:2]
    x0, y0 = np.rint((cells.low[cell, :2] - first) / spacing).astype(int)
    x1, y1 = np.rint((cells.high[cell, :2] - first) / spacing).astype(int)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(x0, x1 + 1), np.arange(y0, y1 + 1)))
    border = (x == x0) | (x == x1) | (y == y0) | (y == y1)
    chosen = border | ((x - x0) % _INNER + (y - y0) % _INNER == 0)
    plan = np.stack([x, y], axis=1)[chosen] * spacing
    extent = spacing * (np.array(terrain.heights.shape) - 1)
    plan = np.clip(plan, _WITHIN * extent, (1.0 - _WITHIN) * extent) + terrain.corner
    heights = np.full(len(plan), cells.high[cell, 2] + upright.origin[2])
    eyes = np.column_stack([plan, heights])
    return np.asarray(~np.isnan(terrain_seen_from(terrain, eyes, azimuths)).all(axis=0))


def _judged(
    terrain: Terrain, upright: UprightScene, cells: ViewCells, options: PvsOptions, lots: Places,
    seen: BoolArray,
) -> Row:  # fmt: skip
    begin, processor = time.perf_counter(), time.process_time()
    pvs = find_pvs(upright, cells, options, terrain=terrain).pvs
    seconds, processor = time.perf_counter() - begin, time.process_time() - processor
    sets = np.array([pvs.visible(cell) for cell in range(len(cells))])
    return {"seconds": seconds, "processor_seconds": processor, "hidden": 1.0 - sets.mean(),
            **_beside(sets[lots], seen)}  # fmt: skip


def _published(
    terrain: Terrain, upright: UprightScene, cells: ViewCells, lots: Places,
    seen: BoolArray, step: int,
) -> Row:  # fmt: skip
    """The published form, from the columns by lot alone."""
    posts = SweepPosts.of(terrain, 1)
    columns, rows = terrain.numbers.shape
    # Plans are counted by column from the south, cells by column from the north.
    plan_of = np.arange(columns * rows).reshape(columns, rows)[:, ::-1].ravel()
    numbers = terrain.numbers[:, ::-1].ravel()
    tops = np.floor(cells.high[plan_of, 2] + upright.origin[2]).astype(np.int64)[:, None]
    published_sets(posts, tops, plan_of[:0], step)  # compiles it
    begin, processor = time.perf_counter(), time.process_time()
    found = published_sets(posts, tops, plan_of[lots], step)[:, :, 0]
    share = len(lots) / len(cells)
    seconds, processor = time.perf_counter() - begin, time.process_time() - processor
    sets = np.empty_like(found)
    sets[:, numbers] = found
    return {"seconds": seconds / share, "processor_seconds": processor / share,
            "hidden": 1.0 - sets.mean(), **_beside(sets, seen)}  # fmt: skip


def _beside(sets: BoolArray, seen: BoolArray) -> Row:
    hidden = int(np.count_nonzero(~sets & ~seen))
    return {
        "columns_checked": len(sets),
        "sampled_hidden": 1.0 - float(seen.mean()),
        "share_of_sampled": hidden / max(int(np.count_nonzero(~seen)), 1),
        "sets_to_seen": float(sets.sum() / seen.sum()),
        "leaks": int(np.count_nonzero(seen & ~sets)),
    }


def _sweeps(terrain: Terrain, size: int) -> int:
    posts = SweepPosts.of(terrain, size)
    return sum(map(len, posts.x.stands)) * sum(map(len, posts.y.stands))
