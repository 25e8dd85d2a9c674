"""Scene + ViewCells -> what cull maps see: the method of visible sets that fuses occluders."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import PRISM, ViewCells
from simplifier.options.visibility import Backend, PvsOptions
from simplifier.visibility.cull_maps.coded_field import CodedField
from simplifier.visibility.cull_maps.cull_map import CullMaps, see_by_cull_maps
from simplifier.visibility.cull_maps.cull_map_gl import OpenGLCullMaps, check_opengl
from simplifier.visibility.cull_maps.memory import check_memory
from simplifier.visibility.cull_maps.object_slices import slices_by_cull_maps
from simplifier.visibility.method import Seen, Sight, Task, without_buried
from simplifier.visibility.solid.height_field import HeightField, height_field
from simplifier.visibility.solid.terrain import terrain_field
from simplifier.visibility.solid.viewer_fill import Filled, fill_by_viewers, fill_warnings

_FINE = 0.2  # of epsilon: a pixel of the height field
_MOST_PIXELS = 8192  # along the longest edge
_BATCH = 32  # cells between two looks at the clock
_LOST = 0.2  # share of what stands there that may not count as solid without a word

Chosen = NDArray[np.int64]
See = Callable[..., Seen]
"""Of cells, places among them, and objects that are looked for: by default all."""


@contextmanager
def by_cull_maps(task: Task) -> Iterator[Sight]:
    """Cull maps of the whole scene: a quick look, and a close one on the processor.

    Raises :class:`OptionError` for an epsilon that would take too fine a raster, for slices by
    OpenGL or of a terrain, and for cells that lie in an object wholly unless they are skipped, and
    :class:`~simplifier.errors.BackendUnavailableError` without the OpenGL that was asked for, and
    :class:`~simplifier.errors.MemoryLimitError` before it takes more than the options allow.
    """
    upright, cells, options, opaque = task.upright, task.cells, task.options, task.opaque
    if options.slices:
        _check_slices(task)
    if options.backend == "opengl":
        check_opengl()
    pixel = _pixel(upright, cells, options)
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    check_memory(upright, cells, pixel, _FINE, options.memory_limit, task.terrain is not None)
    if task.terrain is None:
        field = height_field(upright, pixel, plan, options.ground, task.tell_objects, opaque)
    else:
        field = terrain_field(task.terrain, upright, pixel, plan)
    cells = without_buried(
        task, _buried(cells, field), partial(_name_around, cells, field, upright)
    )
    filled: Filled | None = None
    sheets = task.terrain is None and (opaque is None or len(opaque) > 0)
    if options.fill == "viewers" and sheets:
        eye = options.eye_height if options.ground else None
        filled = fill_by_viewers(field, upright, cells, eye, opaque)
        field = filled.field
    looks = _looks(field, options)
    with _cull_maps_by(options.backend, looks, upright.boxes if options.slices else None) as see:
        yield Sight(
            "cull-map",
            cells,
            partial(see, cells),
            batch=_BATCH if options.backend == "cpu" else 1,
            portable=options.backend == "cpu",
            conservative=filled is None or filled.conservative,
            reason=_reason(field, options),
            warnings=lambda: (
                _warnings(field, task) + ([] if filled is None else fill_warnings(filled))
            ),
            maps=looks[-1],
            narrow=partial(see, cells),
            leaks=() if filled is None else filled.leaks,
        )


def _check_slices(task: Task) -> None:
    if task.options.backend == "opengl":
        raise OptionError(
            "OpenGL finds none", where="slices",
            remedy="leave --slices out, or choose --backend cpu",
        )  # fmt: skip
    if task.terrain is not None:
        raise OptionError(
            "tiles of a terrain are drawn as wholes", where="slices", remedy="leave --slices out"
        )


def _looks(field: HeightField, options: PvsOptions) -> tuple[CullMaps, ...]:
    """A quick look at all objects, and on the processor a close one at those that it leaves: with
    pieces of edge as long as two pixels, about as much as these shrink occluders by anyway.
    """
    coded = CodedField(field)
    quick, close = (CullMaps(field, 2.0 * reach, coded) for reach in (options.reach, field.cell))
    return (quick, close) if options.backend == "cpu" else (quick,)


@contextmanager
def _cull_maps_by(
    backend: Backend, looks: tuple[CullMaps, ...], boxes: FloatArray | None
) -> Iterator[See]:
    """What sees from cells, on the processor or by OpenGL, which takes the first look alone.

    ``boxes``  (n, 2, 3) of the objects, to be cut into slices on the processor; None for no slices.
    """
    if backend == "cpu":
        yield partial(_seen_by_looks, looks, boxes)
        return
    with OpenGLCullMaps(looks[0]) as drawn:
        yield lambda cells, chosen, wanted=None: Seen(
            _within(drawn.see(cells.some(chosen))[0], wanted)
        )


def _seen_by_looks(
    looks: tuple[CullMaps, ...], boxes: FloatArray | None, cells: ViewCells, chosen: Chosen,
    wanted: BoolArray | None = None,
) -> Seen:  # fmt: skip
    """What no look hides, and with boxes which slices of that the last one hides."""
    some = cells.some(chosen)
    visible = _see_by_looks(looks, some, wanted)
    if boxes is None:
        return Seen(visible)
    return Seen(*slices_by_cull_maps(looks[-1], some, visible, boxes))


def _within(seen: BoolArray, wanted: BoolArray | None) -> BoolArray:
    return seen if wanted is None else seen & wanted


def _see_by_looks(
    looks: tuple[CullMaps, ...], cells: ViewCells, wanted: BoolArray | None = None
) -> BoolArray:
    """(c, n) what no look hides; each has what those before have left to look for."""
    for maps in looks:
        wanted, _ = see_by_cull_maps(maps, cells, wanted=wanted)
    assert wanted is not None
    return wanted


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


def _buried(cells: ViewCells, field: HeightField) -> BoolArray:
    """(c,) whether each cell lies in solid wholly."""
    first = np.floor((cells.low[:, :2] - field.low) / field.cell).astype(np.int64)
    last = np.floor((cells.high[:, :2] - field.low) / field.cell).astype(np.int64)
    buried: BoolArray = np.zeros(len(cells), dtype=np.bool_)
    for cell, ((x0, y0), (x1, y1)) in enumerate(zip(first, last, strict=True)):
        heights = field.inner[x0 : x1 + 1, y0 : y1 + 1]
        if cells.kinds[cell] == PRISM:
            (x0, y0), touched = field.touched(cells.outline(cell))
            wx, wy = touched.shape
            heights = field.inner[x0 : x0 + wx, y0 : y0 + wy][touched]
        buried[cell] = heights.min() >= cells.high[cell, 2]
    return buried


def _name_around(cells: ViewCells, field: HeightField, upright: UprightScene, cell: int) -> str:
    found = int(field.objects_in(cells.outline(cell))[0])
    return f"'{upright.scene.names[found]}' and what touches it"


def _warnings(field: HeightField, task: Task) -> list[str]:
    told, options = [], task.options
    if field.lost > _LOST:
        told.append(
            f"{100.0 * field.lost:.0f} % of what stands in the scene is not solid from the ground"
            f" up, and hides nothing{_remedy(options)}"
        )
    thin = _thin_share(field, options.reach)
    if thin > _LOST:
        kept = _kept_by(field, options.reach)
        told.append(
            f"{100.0 * thin:.0f} % of what is solid is thinner than twice an epsilon of"
            f" {options.reach:g}, and hides less; try --epsilon {kept:g}"
        )
    return told


def _remedy(options: PvsOptions) -> str:
    """What to try where much does not stand on the ground; auto has looked at slices itself."""
    tried = [] if options.ground else ["--ground"]
    tried += [] if options.method == "auto" else ["--method slice-wise"]
    return f"; try {', or '.join(tried)}" if tried else ""


def _reason(field: HeightField, options: PvsOptions) -> str:
    """Why sets are found by cull maps, as the end of a sentence."""
    if options.method != "auto":
        return "as was asked for"
    if field.holed is not None:
        return "since a terrain has one height at each place"
    solid = f"{100.0 * (1.0 - field.lost):.0f} % of what stands in the scene is solid from"
    return f"since {solid} the ground up"


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
