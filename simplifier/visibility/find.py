"""Scene + ViewCells -> Pvs: what may be visible from each cell."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.culling.visible_sets import scene_digest
from simplifier.errors import CancelledError
from simplifier.geometry.pvs import UNKNOWN, Pvs, float32_below, pack_rows
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.simplify import Axis
from simplifier.options.visibility import PvsOptions
from simplifier.progress import Cancel, Deadline, TellCount
from simplifier.visibility.columns.by_voxel_columns import by_voxel_columns
from simplifier.visibility.cull_maps.by_cull_maps import by_cull_maps
from simplifier.visibility.cull_maps.cull_map import CullMaps
from simplifier.visibility.known import Known, altitudes_of, kept, known_of, slices_of
from simplifier.visibility.method import Method, Task
from simplifier.visibility.object_order import few_runs
from simplifier.visibility.slices.by_slices import by_slices
from simplifier.visibility.solid.fill_leaks import FillLeak
from simplifier.visibility.solid.terrain import Terrain
from simplifier.visibility.strong.by_strong_occluders import by_strong_occluders

_FORMAT = 4  # raised when the same input is to give other sets

METHODS: dict[str, Method] = {
    "auto": by_cull_maps,
    "cull-map": by_cull_maps,
    "slice-wise": by_slices,
    "voxel-column": by_voxel_columns,
    "strong": by_strong_occluders,
}


@dataclass(frozen=True, eq=False)
class Found:
    """The sets, and what the user should know.

    ``maps`` what they were looked up in last, where that is cull maps.  ``made`` cells that were
    computed now; ``seconds`` each took in the mean; ``reason`` why sets were found as they were.
    ``leaks`` spaces that would be solid, were it not for a hole.
    """

    pvs: Pvs
    maps: CullMaps | None
    made: int
    seconds: float
    warnings: tuple[str, ...]
    reason: str
    leaks: tuple[FillLeak, ...] = ()


def find_pvs(
    upright: UprightScene,
    cells: ViewCells,
    options: PvsOptions,
    before: Pvs | None = None,
    tell: TellCount = lambda done, total: None,
    cancel: Cancel | None = None,
    tell_objects: TellCount = lambda done, total: None,
    opaque: Scene | None = None,
    terrain: Terrain | None = None,
) -> Found:
    """What may be visible from each cell; the cells' coordinates are upright.

    ``opaque`` is what of the scene hides anything, by the objects' names: by default all of it.
    ``terrain`` is what the scene was made of, if it is one.
    ``tell_objects`` hears of the objects whose heights are known, ``tell`` then of the cells.

    Sets that were found ``before`` in the same scene with the same settings are kept.  Once
    ``cancel`` is set or the time is up, the cells that are left count as seeing everything; without
    any, :class:`CancelledError` is raised.  Raises what the method of the options does.
    """
    deadline = Deadline.after(options.time_limit)
    scene, settings = scene_digest(upright.scene, opaque), settings_digest(options)

    def watch(objects: int, total: int) -> None:
        if cancel is not None and cancel.is_set():
            raise CancelledError("cancelled before the first cell was done")
        tell_objects(objects, total)

    task = Task(upright, cells, options, opaque, terrain, watch)
    with METHODS[options.method](task) as sight:
        cells = sight.cells
        low, step = float32_below(sight.altitude_low), float32_below(sight.altitude_step)
        known: list[Known | None] = [None] * len(cells)
        if before is not None and (before.scene, before.settings) == (scene, settings):
            known = kept(cells, before, low, step)
        left = np.flatnonzero([each is None for each in known])
        done, begun = 0, time.perf_counter()
        for first in range(0, len(left), sight.batch):
            tell(len(cells) - len(left) + done, len(cells))
            if (cancel is not None and cancel.is_set()) or deadline.is_up:
                break
            some = left[first : first + sight.batch]
            for cell, each in zip(some.tolist(), known_of(sight.see(some)), strict=True):
                known[cell] = each
            done += len(some)
        seconds = (time.perf_counter() - begun) / max(done, 1)
    tell(len(cells) - len(left) + done, len(cells))
    if all(each is None for each in known):
        raise CancelledError("cancelled before the first cell was done")
    sure = sight.conservative
    if before is not None and len(left) < len(cells):
        sure = sure and before.conservative  # of what is kept
    pvs = replace(
        _packed(upright, cells, known, scene, settings, sight.method, sure),
        slices=slices_of(known),
        altitudes=altitudes_of(known, len(upright.scene), low, step),
    )
    warnings = [*sight.warnings(), *_unfinished(pvs)]
    return Found(pvs, sight.maps, done, seconds, tuple(warnings), sight.reason, sight.leaks)


def settings_digest(options: PvsOptions) -> bytes:
    """8 bytes of all that a cell's set depends on beside the scene and the cell."""
    kept: tuple[object, ...] = (_FORMAT, options.reach, options.up, options.ground)
    if options.fill == "viewers":
        kept += (options.fill, options.eye_height)
    if options.backend != "cpu":
        kept += (options.backend,)
    if options.method == "slice-wise":
        kept = (_FORMAT, options.method, options.reach, options.up)
    if options.method == "voxel-column":
        kept = (_FORMAT, options.method, options.epsilon)
    if options.method == "strong":
        kept = (_FORMAT, options.method, options.up, options.ground)
    return bytes(hashlib.blake2b(repr(kept).encode(), digest_size=8).digest())


def _packed(
    upright: UprightScene, cells: ViewCells, known: list[Known | None], scene: bytes,
    settings: bytes, method: str, conservative: bool,
) -> Pvs:  # fmt: skip
    computed = [cell for cell, each in enumerate(known) if each is not None]
    sets = [each.visible for each in known if each is not None]
    order = few_runs(sets, upright.boxes[:, :, :2].mean(axis=1))
    rows, places = pack_rows(row[order] for row in sets)
    row_of = np.full(len(cells), UNKNOWN, dtype=np.int64)
    row_of[computed] = places
    up = cast(Axis, "xyz"[int(upright.order[2])])
    return Pvs(
        up, upright.origin, upright.scene.names, order, cells, rows, row_of, method,
        conservative, scene, settings,
    )  # fmt: skip


def _unfinished(pvs: Pvs) -> list[str]:
    if not pvs.partial:
        return []
    left = len(pvs.cells) - len(pvs.computed)
    return [f"{left:,} of {len(pvs.cells):,} cells are not computed yet, and see everything"]
