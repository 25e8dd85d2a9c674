"""Scene + ViewCells -> Pvs: what may be visible from each cell."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.culling.visible_sets import scene_digest
from simplifier.errors import CancelledError, OptionError
from simplifier.geometry.pvs import UNKNOWN, Pvs, pack_rows
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import PRISM, ViewCells
from simplifier.options.simplify import Axis
from simplifier.options.visibility import Backend, PvsOptions
from simplifier.progress import Cancel, Deadline, TellCount
from simplifier.visibility.cull_map import CullMaps, see_by_cull_maps
from simplifier.visibility.cull_map_gl import OpenGLCullMaps, check_opengl
from simplifier.visibility.fill_leaks import FillLeak
from simplifier.visibility.height_field import HeightField, height_field
from simplifier.visibility.memory import check_memory
from simplifier.visibility.object_order import few_runs
from simplifier.visibility.terrain import Terrain, terrain_field
from simplifier.visibility.viewer_fill import Filled, fill_by_viewers, fill_warnings

_FINE = 0.2  # of epsilon: a pixel of the height field
_MOST_PIXELS = 8192  # along the longest edge
_BATCH = 32  # cells between two looks at the clock
_FORMAT = 2  # raised when the same input is to give other sets
_LOST = 0.2  # share of what stands there that may not count as solid without a word
_UPRIGHT = 0.05  # of what stands there: if no more is lost, a raster of heights has it all


@dataclass(frozen=True, eq=False)
class Found:
    """The sets, and what the user should know.

    ``maps`` what they were looked up in.  ``made`` cells that were computed now; ``seconds`` each
    took in the mean; ``reason`` why sets were found as they were.  ``leaks`` spaces that would be
    solid, were it not for a hole.
    """

    pvs: Pvs
    maps: CullMaps
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
    any, :class:`CancelledError` is raised.  Raises :class:`OptionError` for an epsilon that would
    take too fine a raster, and for cells that lie in an object wholly unless they are skipped, and
    :class:`~simplifier.errors.BackendUnavailableError` without the OpenGL that was asked for, and
    :class:`~simplifier.errors.MemoryLimitError` before it takes more than the options allow.
    """
    if options.backend == "opengl":
        check_opengl()
    deadline = Deadline.after(options.time_limit)
    scene, settings = scene_digest(upright.scene, opaque), settings_digest(options)
    pixel = _pixel(upright, cells, options)
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    check_memory(upright, cells, pixel, _FINE, options.memory_limit, terrain is not None)

    def watch(objects: int, total: int) -> None:
        if cancel is not None and cancel.is_set():
            raise CancelledError("cancelled before the first cell was done")
        tell_objects(objects, total)

    if terrain is None:
        field = height_field(upright, pixel, plan, options.ground, watch, opaque)
    else:
        field = terrain_field(terrain, upright, pixel, plan)
    cells = _without_buried(cells, field, options, upright.scene)
    known = _kept(cells, before, scene, settings)
    filled: Filled | None = None
    sheets = terrain is None and (opaque is None or len(opaque) > 0)
    if options.fill == "viewers" and sheets:
        eye = options.eye_height if options.ground else None
        filled = fill_by_viewers(field, upright, cells, eye, opaque)
        field = filled.field
    left = np.flatnonzero([row is None for row in known])
    maps = CullMaps(field, 2.0 * options.reach)
    done, begun = 0, time.perf_counter()
    batch = _BATCH if options.backend == "cpu" else 1
    with _cull_maps_by(options.backend, maps) as see:
        for first in range(0, len(left), batch):
            tell(len(cells) - len(left) + done, len(cells))
            if (cancel is not None and cancel.is_set()) or deadline.is_up:
                break
            some = left[first : first + batch]
            seen, _ = see(cells.some(some))
            for cell, row in zip(some.tolist(), seen, strict=True):
                known[cell] = row
            done += len(some)
    tell(len(cells) - len(left) + done, len(cells))
    if all(row is None for row in known):
        raise CancelledError("cancelled before the first cell was done")
    sure = filled is None or filled.conservative
    if before is not None and len(left) < len(cells):
        sure = sure and before.conservative  # of what is kept
    pvs = _packed(upright, cells, known, scene, settings, sure)
    seconds = (time.perf_counter() - begun) / max(done, 1)
    warnings = _warnings(field, pvs, options) + ([] if filled is None else fill_warnings(filled))
    leaks = () if filled is None else filled.leaks
    return Found(pvs, maps, done, seconds, tuple(warnings), _reason(field, options), leaks)


See = Callable[[ViewCells], tuple[BoolArray, NDArray[np.int64]]]


@contextmanager
def _cull_maps_by(backend: Backend, maps: CullMaps) -> Iterator[See]:
    """What sees from cells, on the processor or by OpenGL."""
    if backend == "cpu":
        yield partial(see_by_cull_maps, maps)
        return
    with OpenGLCullMaps(maps) as drawn:
        yield drawn.see


def settings_digest(options: PvsOptions) -> bytes:
    """8 bytes of all that a cell's set depends on beside the scene and the cell."""
    kept: tuple[object, ...] = (_FORMAT, options.reach, options.up, options.ground)
    if options.fill == "viewers":
        kept += (options.fill, options.eye_height)
    if options.backend != "cpu":
        kept += (options.backend,)
    return bytes(hashlib.blake2b(repr(kept).encode(), digest_size=8).digest())


def _pixel(upright: UprightScene, cells: ViewCells, options: PvsOptions) -> float:
    """The edge of a pixel; an epsilon of several can be kept."""
    longest = float(np.max(upright.extent[:2]))
    longest = max(longest, float((cells.high - cells.low)[:, :2].max()))
    least = longest / _MOST_PIXELS
    if options.reach < least:
        raise OptionError(
            f"{options.reach:g} is finer than the raster of this scene can be", where="epsilon",
            remedy=f"choose {least:.3g} or more",
        )  # fmt: skip
    return max(_FINE * options.reach, least)


def _without_buried(
    cells: ViewCells, field: HeightField, options: PvsOptions, scene: Scene
) -> ViewCells:
    """The cells that do not lie in solid wholly; without leave to skip them all have to."""
    first = np.floor((cells.low[:, :2] - field.low) / field.cell).astype(np.int64)
    last = np.floor((cells.high[:, :2] - field.low) / field.cell).astype(np.int64)
    kept = np.ones(len(cells), dtype=np.bool_)
    for cell, ((x0, y0), (x1, y1)) in enumerate(zip(first, last, strict=True)):
        heights = field.inner[x0 : x1 + 1, y0 : y1 + 1]
        if cells.kinds[cell] == PRISM:
            (x0, y0), touched = field.touched(cells.outline(cell))
            wx, wy = touched.shape
            heights = field.inner[x0 : x0 + wx, y0 : y0 + wy][touched]
        if heights.min() < cells.high[cell, 2]:
            continue
        if not options.skip_buried:
            name = scene.names[int(field.objects_in(cells.outline(cell))[0])]
            raise OptionError(
                f"cell {cell} lies wholly within '{name}' and what touches it", where="cells",
                remedy="leave it out, or add --skip-buried",
            )  # fmt: skip
        kept[cell] = False
    if not kept.any():
        raise OptionError("all of them lie within objects", where="cells", remedy="move them")
    return cells if kept.all() else cells.some(kept)


def _kept(
    cells: ViewCells, before: Pvs | None, scene: bytes, settings: bytes
) -> list[BoolArray | None]:
    """The set of each cell that was found before, in the same scene by the same settings."""
    if before is None or before.scene != scene or before.settings != settings:
        return [None] * len(cells)
    places = {_key(before.cells, cell): cell for cell in range(len(before.cells))}
    found = [places.get(_key(cells, cell)) for cell in range(len(cells))]
    return [
        None if cell is None or before.row_of[cell] == UNKNOWN else before.visible(cell)
        for cell in found
    ]


def _key(cells: ViewCells, cell: int) -> bytes:
    parts = (cells.low[cell], cells.high[cell], cells.corners[cell])
    return b"".join(part.tobytes() for part in parts)


def _packed(
    upright: UprightScene, cells: ViewCells, known: list[BoolArray | None], scene: bytes,
    settings: bytes, conservative: bool,
) -> Pvs:  # fmt: skip
    computed = [cell for cell, row in enumerate(known) if row is not None]
    sets = [row for row in known if row is not None]
    order = few_runs(sets, upright.boxes[:, :, :2].mean(axis=1))
    rows, places = pack_rows(row[order] for row in sets)
    row_of = np.full(len(cells), UNKNOWN, dtype=np.int64)
    row_of[computed] = places
    up = cast(Axis, "xyz"[int(upright.order[2])])
    return Pvs(
        up, upright.origin, upright.scene.names, order, cells, rows, row_of, "cull-map",
        conservative, scene, settings,
    )  # fmt: skip


def _warnings(field: HeightField, pvs: Pvs, options: PvsOptions) -> list[str]:
    told = []
    if field.lost > _LOST:
        told.append(
            f"{100.0 * field.lost:.0f} % of what stands in the scene is not solid from the ground"
            " up, and hides nothing" + ("" if options.ground else "; try --ground")
        )
    thin = _thin_share(field, options.reach)
    if thin > _LOST:
        better = _kept_by(field, options.reach)
        told.append(
            f"{100.0 * thin:.0f} % of what is solid is thinner than twice an epsilon of"
            f" {options.reach:g}, and hides little; try --epsilon {better:g}"
        )
    if pvs.partial:
        left = len(pvs.cells) - len(pvs.computed)
        told.append(
            f"{left:,} of {len(pvs.cells):,} cells are not computed yet, and see everything"
        )
    return told


def _reason(field: HeightField, options: PvsOptions) -> str:
    """Why sets are found by cull maps, as the end of a sentence."""
    if options.method != "auto":
        return "as was asked for"
    if field.holed is not None:
        return "since a terrain has one height at each place"
    solid = f"{100.0 * (1.0 - field.lost):.0f} % of what stands in the scene is solid from"
    if field.lost <= _UPRIGHT:
        return f"since {solid} the ground up"
    return f"which is all there is, though only {solid} the ground up"


def _kept_by(field: HeightField, reach: float) -> float:
    """An epsilon that most of what is solid is thick enough for, or that of a pixel."""
    while reach > field.cell and _thin_share(field, reach) > _LOST:
        reach *= 0.5
    return reach


def _thin_share(field: HeightField, reach: float) -> float:
    """Of the solid pixels, those that are thinner than twice the reach along an axis."""
    solid = np.isfinite(field.inner)
    if not solid.any():
        return 0.0
    size = 2 * int(np.ceil(reach / field.cell)) + 1
    kept = solid.copy()
    for axis in (0, 1):
        inner = ndimage.minimum_filter1d(solid, size, axis=axis, mode="constant", cval=False)
        kept &= ndimage.maximum_filter1d(inner, size, axis=axis, mode="constant", cval=False)
    return 1.0 - float(kept.sum() / solid.sum())
