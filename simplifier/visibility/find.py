"""Scene + ViewCells -> Pvs: what may be visible from each cell."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.culling.visible_sets import scene_digest
from simplifier.errors import CancelledError
from simplifier.geometry.pvs import UNKNOWN, Pvs, float32_below, pack_rows
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.threads import thread_count
from simplifier.options.simplify import Axis
from simplifier.options.visibility import PvsOptions
from simplifier.pools import Pool
from simplifier.progress import Cancel, Deadline, TellCount
from simplifier.visibility.choose import (
    BOTH,
    CULL_MAP,
    SLICES,
    STRONG,
    TERRAIN,
    WAYS,
    Way,
    chosen_sight,
)
from simplifier.visibility.columns.by_voxel_columns import by_voxel_columns
from simplifier.visibility.cost import NO_COST, Cost, CostMeter, batches
from simplifier.visibility.cull_maps.by_cull_maps import by_cull_maps
from simplifier.visibility.cull_maps.cull_map import CullMaps
from simplifier.visibility.known import Known, altitudes_of, kept, known_of, slices_of
from simplifier.visibility.method import Method, Sight, Task
from simplifier.visibility.object_order import few_runs
from simplifier.visibility.slices.by_slices import by_slices
from simplifier.visibility.solid.fill_leaks import FillLeak
from simplifier.visibility.solid.terrain import Terrain
from simplifier.visibility.spread import look_from
from simplifier.visibility.strong.by_strong_occluders import by_strong_occluders
from simplifier.visibility.strong.strong_occluders import StrongOccluders

_FORMAT = 4  # raised when the same input is to give other sets
_SHAFTS = 4  # the same, of slices alone
_BODIES = 1  # the same, of strong occluders alone

WORTH_A_POOL = 10.0
"""Seconds that the cells that are left would take here, for which they are given to others: it
takes some until these have what sees, and have started processes."""

_JOB_SECONDS = 1.0  # of a processor: cells that go together
_MOST_IN_JOB = 256

METHODS: dict[str, Method] = {
    "cull-map": by_cull_maps,
    "slice-wise": by_slices,
    "voxel-column": by_voxel_columns,
    "strong": by_strong_occluders,
}


@dataclass(frozen=True, eq=False)
class Watch:
    """Who hears how far a run is, and how it is ended.

    ``tell``          hears how many cells are done, and of how many.
    ``tell_objects``  hears before that of the objects that are read, by one method after the other.
    ``tell_cost``     hears what the cells will cost, once a few are done.
    ``say``           hears in a sentence where cells are seen from, where a pool was given.
    ``cancel``        once it is set, the cells that are left count as seeing everything.
    """

    tell: TellCount = lambda done, total: None
    tell_objects: TellCount = lambda done, total: None
    tell_cost: Callable[[Sight, Cost], None] = lambda sight, cost: None
    say: Callable[[str], None] = lambda line: None
    cancel: Cancel | None = None

    @property
    def is_cancelled(self) -> bool:
        return self.cancel is not None and self.cancel.is_set()


UNWATCHED = Watch()


@dataclass(frozen=True, eq=False)
class Found:
    """The sets, and what the user should know.

    ``maps`` what they were looked up in last, where that is cull maps.  ``occluders`` that each
    hide something by themselves, where these were looked for.
    ``made`` cells that were computed now; ``reason`` why sets were found as they were.
    ``leaks`` spaces that would be solid, were it not for a hole.
    ``way`` the methods by their options' names, one after the other.  ``cost`` of the cells that
    were computed now, and ``foretold`` by some of them; None where there were too few.
    """

    pvs: Pvs
    maps: CullMaps | None
    made: int
    warnings: tuple[str, ...]
    reason: str
    leaks: tuple[FillLeak, ...] = ()
    way: Way = CULL_MAP
    cost: Cost = NO_COST
    foretold: Cost | None = None
    occluders: StrongOccluders | None = None

    @property
    def seconds(self) -> float:
        """That each cell took in the mean."""
        return self.cost.seconds_a_cell


def find_pvs(
    upright: UprightScene,
    cells: ViewCells,
    options: PvsOptions,
    before: Pvs | None = None,
    watch: Watch = UNWATCHED,
    *,
    opaque: Scene | None = None,
    terrain: Terrain | None = None,
    pool: Pool | None = None,
) -> Found:
    """What may be visible from each cell; the cells' coordinates are upright.

    ``opaque`` is what of the scene hides anything, by the objects' names: by default all of it.
    ``terrain`` is what the scene was made of, if it is one.
    ``pool`` sees from the cells in place of this machine, once a few of them have shown that this
    would take :data:`WORTH_A_POOL` seconds; the sets are the same.

    Sets that were found ``before`` in the same scene with the same settings are kept.  Once it is
    cancelled or the time is up, the cells that are left count as seeing everything; without any,
    :class:`CancelledError` is raised.  Raises what the method of the options does.
    """
    deadline, meter = Deadline.after(options.time_limit), CostMeter()
    scene = scene_digest(upright.scene, opaque)

    def tell_objects(objects: int, total: int) -> None:
        if watch.is_cancelled:
            raise CancelledError("cancelled before the first cell was done")
        watch.tell_objects(objects, total)

    def is_over() -> bool:
        return watch.is_cancelled or deadline.is_up

    task = Task(upright, cells, options, opaque, terrain, tell_objects)
    with _sight_of(task, before if before is not None and before.scene == scene else None) as (
        sight,
        way,
    ):
        cells, settings = sight.cells, settings_digest(options, way)
        low, step = float32_below(sight.altitude_low), float32_below(sight.altitude_step)
        known: list[Known | None] = [None] * len(cells)
        if before is not None and (before.scene, before.settings) == (scene, settings):
            known = kept(cells, before, low, step)
        left = sum(each is None for each in known)
        meter.ready()
        lost = _look(sight, known, meter, watch, is_over, pool, len(upright.scene))
    if all(each is None for each in known):
        raise CancelledError("cancelled before the first cell was done")
    sure = sight.conservative
    if before is not None and left < len(cells):
        sure = sure and before.conservative  # of what is kept
    pvs = replace(
        _packed(upright, cells, known, scene, settings, sight.method, sure),
        slices=slices_of(known),
        altitudes=altitudes_of(known, len(upright.scene), low, step),
    )
    made = left - sum(each is None for each in known)
    warnings = [*sight.warnings(), *_unfinished(pvs), *lost]
    return Found(
        pvs, sight.maps, made, tuple(warnings), sight.reason, sight.leaks, way, meter.came,
        meter.foretold, sight.occluders,
    )  # fmt: skip


@contextmanager
def _sight_of(task: Task, before: Pvs | None) -> Iterator[tuple[Sight, Way]]:
    """What sees from the cells, and by which methods; ``before`` is of the same scene."""
    options = task.options
    if options.method == "auto":
        held = None
        if before is not None:
            digests = {settings_digest(options, way): way for way in WAYS}
            held = digests.get(before.settings)
        with chosen_sight(task, METHODS, held) as (sight, way):
            yield sight, way
        return
    with METHODS[options.method](task) as sight:
        yield sight, (options.method,)


def _look(
    sight: Sight, known: list[Known | None], meter: CostMeter, watch: Watch,
    is_over: Callable[[], bool], pool: Pool | None, objects: int,
) -> list[str]:  # fmt: skip
    """See from the cells that are not ``known``, until it is over; why a pool saw nothing from
    some."""
    left = np.flatnonzero([each is None for each in known])
    if sight.tried is not None and len(left):
        _keep(known, sight.tried.cells, known_of(sight.tried.seen))
        left = np.setdiff1d(left, sight.tried.cells)
        meter.tried(len(sight.tried.cells), sight.tried.seconds)
    rest = len(left)
    lost: list[str] = []
    for some, timed in batches(sight.cells, left, sight.batch):
        watch.tell(len(known) - rest, len(known))
        if is_over():
            break
        _keep(known, some, known_of(sight.see(some)))
        rest -= len(some)
        meter.add(len(some), rest, timed=timed)
        if timed and meter.foretold is not None:
            watch.tell_cost(sight, meter.foretold)
            if pool is not None and _is_worth(sight, meter.foretold, rest, watch):
                watch.say(f"the view cells are computed {pool.where}")
                lost = _spread(sight, known, meter, watch, is_over, pool, objects)
                break
    rest = sum(each is None for each in known)
    watch.tell(len(known) - rest, len(known))
    return lost


def _is_worth(sight: Sight, foretold: Cost, rest: int, watch: Watch) -> bool:
    """Whether so many cells are to be given to others; what speaks against it is said."""
    seconds = foretold.seconds_a_cell * rest
    if sight.portable and seconds >= WORTH_A_POOL:
        return True
    least = f"the {rest:,} that are left take {seconds:.2g} s, and below {WORTH_A_POOL:g} s"
    why = f"{least} others are slower" if sight.portable else f"{sight.method} is not spread"
    watch.say(f"the view cells are computed on this machine: {why}")
    return False


@dataclass(frozen=True)
class _Over:
    """Whether a run is over, as a pool asks it."""

    is_set: Callable[[], bool]


def _spread(
    sight: Sight, known: list[Known | None], meter: CostMeter, watch: Watch,
    is_over: Callable[[], bool], pool: Pool, objects: int,
) -> list[str]:  # fmt: skip
    left = np.flatnonzero([each is None for each in known])
    rest, lost = len(left), []
    assert meter.foretold is not None
    seconds = meter.foretold.seconds_a_cell * thread_count()  # of one processor
    size = int(np.clip(_JOB_SECONDS / max(seconds, 1e-9), 1, _MOST_IN_JOB))
    parts = [left[begin : begin + size] for begin in range(0, len(left), size)]
    with closing(look_from(sight.see, objects, parts, pool, _Over(is_over))) as looked:
        for some, found in looked:
            if isinstance(found, str):
                lost.append(f"{len(some):,} cells are not computed ({found})")
                continue
            _keep(known, some, found)
            rest -= len(some)
            meter.add(len(some), rest, timed=False)
            watch.tell(len(known) - rest, len(known))
    return lost


def _keep(known: list[Known | None], some: NDArray[np.int64], found: Sequence[Known]) -> None:
    for cell, each in zip(some.tolist(), found, strict=True):
        known[cell] = each


def settings_digest(options: PvsOptions, way: Way | None = None) -> bytes:
    """8 bytes of all that a cell's set depends on beside the scene and the cell.

    ``way``  the methods that find it; by default that of the options, and cull maps for "auto".
    """
    if way is None:
        way = CULL_MAP if options.method == "auto" else (options.method,)
    kept: tuple[object, ...] = (_FORMAT, options.reach, options.up, options.ground)
    if options.fill == "viewers":
        kept += (options.fill, options.eye_height)
    if options.backend != "cpu":
        kept += (options.backend,)
    if options.slices:
        kept += ("slices",)
    if way == SLICES:
        kept = (_FORMAT, _SHAFTS, *way, options.reach, options.up, *filter(None, [options.seed]))
    if way == STRONG:
        kept = (_FORMAT, _BODIES, *way, options.up, options.ground)
    if way == TERRAIN:
        kept = (_FORMAT, *way, options.epsilon)
    if way == BOTH:
        kept += way
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
