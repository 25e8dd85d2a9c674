"""Task -> the methods that find its sets, and why: what ``--method auto`` takes.

The choice hangs on the scene and its cells alone, never on a clock, so that the same input gives
the same sets (docs/decisions/0024-how-the-method-is-chosen.md).  Methods that never leave out what
is visible come first; slices, which may, are taken only where they leave less than half as much.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import MemoryLimitError, OptionError
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.columns.tile_cells import columns_serve, tile_size
from simplifier.visibility.known import cell_key
from simplifier.visibility.method import Method, Narrow, See, Seen, Sight, Task, Tried
from simplifier.visibility.scene_look import has_storeys, look_at, spread, standing_share
from simplifier.visibility.slices.by_slices import open_surface, too_many_voxels
from simplifier.visibility.solid.terrain import Terrain

Way = tuple[str, ...]
"""Methods, one after the other: each looks only for what those before it leave open."""

CULL_MAP: Way = ("cull-map",)
STRONG: Way = ("strong",)
BOTH: Way = ("strong", "cull-map")
SLICES: Way = ("slice-wise",)
TERRAIN: Way = ("voxel-column",)
WAYS = (CULL_MAP, STRONG, BOTH, SLICES, TERRAIN)

_STANDING = 0.5  # share of the solid from the ground up that cull maps need at least
_CONVEX = 0.8  # share of the objects that strong occluders need, to come first
_NARROW = 0.8  # of the occluders' median width: cells from which they hide much
_OPEN = 1.0 / 3.0  # share of the surface that slices may lack
_WIDE = 2.0 / 3.0  # of a tile: cells from which voxel columns leave as little as cull maps do
_FEW = 0.25  # cells a tile: for fewer, sweeps over all tiles cost more than looking from each
_TRIED = 4  # cells
_WORTH = 0.5  # of the conservative sets: smaller ones are worth not being conservative


@contextmanager
def chosen_sight(
    task: Task, methods: Mapping[str, Method], held: Way | None = None
) -> Iterator[tuple[Sight, Way]]:
    """The sight of the way that serves a task best.

    ``held``  the way of the file that is continued, which is kept.  Raises what its methods do.
    """
    with ExitStack() as stack:
        if held is not None:
            sight = _open(stack, task, methods, held)
            yield replace(sight, reason=_after(held, "as are those in the file")), held
            return
        way, reason = _plan(task, methods)
        if way == STRONG:
            sight, way, reason = _rooms(stack, task, methods, reason)
        elif way == BOTH:
            try:
                sight = _open(stack, task, methods, way)
                reason = sight.reason + reason
            except MemoryLimitError:
                way, reason = STRONG, "since the raster of cull maps needs more than may be taken"
                sight = _open(stack, task, methods, way)
        elif way == TERRAIN:
            try:
                sight = _open(stack, task, methods, way)
                reason = sight.reason + reason
            except (MemoryLimitError, OptionError):  # a cell may reach beyond the terrain
                way = CULL_MAP
                sight = _open(stack, task, methods, way)
                reason = sight.reason
        else:
            sight = _open(stack, task, methods, way)
            reason = sight.reason + reason
        yield replace(sight, reason=_after(way, reason)), way


def _plan(task: Task, methods: Mapping[str, Method]) -> tuple[Way, str]:
    """By a look at the scene alone, and what its sentence goes on with after that of cull maps.

    :data:`STRONG` is yet to be held against slices.
    """
    options = task.options
    if options.fill == "viewers" or options.backend == "opengl" or options.slices:
        return CULL_MAP, ""
    if task.terrain is not None:
        return _over_terrain(task, task.terrain)
    if task.opaque is not None and len(task.opaque) == 0:
        return CULL_MAP, ""
    if has_storeys(task.cells):
        return STRONG, "since cells are on several storeys"
    standing = standing_share(task)
    if standing < _STANDING:
        return STRONG, f"since only {_percent(standing)} is solid from the ground up"
    look = look_at(task)
    if look.convex < _CONVEX:
        return CULL_MAP, f", and only {_percent(look.convex)} of the objects are convex"
    beside = f"the median object is {look.width:.3g} wide (cells: {look.size:.3g})"
    if look.size > _NARROW * look.width:
        return CULL_MAP, f", and {beside}"
    return BOTH, f", {_percent(look.convex)} of the objects are convex, and {beside}"


def _over_terrain(task: Task, terrain: Terrain) -> tuple[Way, str]:
    """Voxel columns serve cells about as wide as tiles; they sweep for all cells or for none."""
    if not columns_serve(terrain, task.options):
        return CULL_MAP, ""
    size = float(np.median((task.cells.high - task.cells.low)[:, :2].max(axis=1)))
    tile = min(tile_size(terrain))
    if size < _WIDE * tile:
        return CULL_MAP, f", and cells are {size:.4g} wide, its tiles {tile:.4g}"
    if len(task.cells) < _FEW * len(terrain.scene):
        return CULL_MAP, f", and its {len(terrain.scene):,} tiles are many for so few cells"
    return TERRAIN, f", and cells are {size:.4g} wide, its tiles {tile:.4g}"


def _rooms(
    stack: ExitStack, task: Task, methods: Mapping[str, Method], reason: str
) -> tuple[Sight, Way, str]:
    """Strong occluders, or slices where these leave less than half as much in a few cells."""
    try:
        sure = _open(stack, task, methods, STRONG)
        way = STRONG
    except OptionError:  # nothing there is an occluder by itself
        sure, way = _open(stack, task, methods, CULL_MAP), CULL_MAP
    if too_many_voxels(task) is not None:
        return sure, way, f"{reason}, and slices would take too many voxels"
    lacking = open_surface(task)
    if lacking > _OPEN:
        return sure, way, f"{reason}, and {_percent(lacking)} of the surface is in no slice"
    slices = _open(stack, task, methods, SLICES)
    some = spread(sure.cells, np.arange(len(sure.cells)), _TRIED)
    there = places_in(slices.cells, sure.cells)[some]
    seen, narrow = _tried(sure, some), _tried(slices, there)
    ratio = float(narrow.seen.visible.sum() / max(seen.seen.visible.sum(), 1))
    tried = f"slices left {_percent(ratio)} of what {_name(way)} leave, in {len(some)} cells"
    if ratio > _WORTH:
        return replace(sure, tried=seen), way, f"{reason}, and {tried}"
    return replace(slices, tried=narrow), SLICES, f"{reason}, and {tried}; --method strong is sure"


def _open(stack: ExitStack, task: Task, methods: Mapping[str, Method], way: Way) -> Sight:
    """The last method of a way, looking only for what those before it leave."""
    last = stack.enter_context(methods[way[-1]](task))
    if len(way) == 1:
        return last
    narrow = last.narrow
    assert narrow is not None
    again = replace(task, cells=last.cells, looked_at_again=True)
    first = stack.enter_context(methods[way[0]](again))
    see = partial(_seen_by_both, first.see, narrow, places_in(last.cells, first.cells))
    return replace(
        last, cells=first.cells, see=see, occluders=first.occluders,
        portable=first.portable and last.portable,
    )  # fmt: skip


def _seen_by_both(
    first: See, narrow: Narrow, places: NDArray[np.int64], chosen: NDArray[np.int64]
) -> Seen:
    return narrow(places[chosen], first(chosen).visible)


def _tried(sight: Sight, some: NDArray[np.int64]) -> Tried:
    begin = time.perf_counter()
    seen = sight.see(some)
    return Tried(some, seen, time.perf_counter() - begin)


def places_in(cells: ViewCells, some: ViewCells) -> NDArray[np.int64]:
    """(k,) where each of some cells is among ``cells``, which hold them all."""
    known = {cell_key(cells, cell): cell for cell in range(len(cells))}
    return np.array([known[cell_key(some, cell)] for cell in range(len(some))], dtype=np.int64)


def _after(way: Way, reason: str) -> str:
    return f"after {_name(way[:1])}, {reason}" if len(way) > 1 else reason


def _name(way: Way) -> str:
    return {"strong": "strong occluders", "cull-map": "cull maps"}.get(way[0], way[0])


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
