"""Elevation model + ViewCells -> what horizons leave: the method of columns over a terrain."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import CancelledError, OptionError
from simplifier.memory.limit import check_need
from simplifier.memory.need import MIB, MemoryNeed
from simplifier.options.visibility import PvsOptions
from simplifier.progress import Deadline
from simplifier.visibility.columns.horizons import AltitudeScale, horizons
from simplifier.visibility.columns.sweep_posts import SweepPosts
from simplifier.visibility.method import Seen, Sight, Task, check_processor
from simplifier.visibility.solid.terrain import Terrain

_ALL = 1 << 40  # cells between two looks at the clock: sweeps serve all of them
_ABOVE = 1e-3  # of the range of heights, that altitudes are counted beyond what is asked for
_EDGE = 1e-9  # of the terrain's posts: rounding is far below it
_LIBRARIES = 60 * MIB  # scipy.ndimage and the kernels
_POST, _PAIR = 160, 6  # bytes of a post, with its tile's mesh; of a column and a tile


@contextmanager
def by_voxel_columns(task: Task) -> Iterator[Sight]:
    """Horizons of all tiles over all columns; a cell has the lowest of those that it lies in.

    Raises :class:`OptionError` for scenes that are no elevation model, for options that only cull
    maps have, and for cells that reach beyond the terrain;
    :class:`~simplifier.errors.MemoryLimitError` before it takes more than the options allow, and
    when it is looked from cells :class:`~simplifier.errors.CancelledError` where the time is up
    before all is swept.
    """
    check_processor(task, "voxel columns")
    terrain, options = task.terrain, task.options
    if terrain is None:
        raise OptionError(
            "voxel columns need an elevation model, .npy or .tif: they know one height at each"
            " place, so that rooms, bridges and overhangs of a mesh would be lost", where="method",
            remedy="choose cull-map for what stands on the ground, or slice-wise for all else",
        )  # fmt: skip
    deadline = Deadline.after(options.time_limit)
    _check_memory(terrain, options.memory_limit)
    posts = SweepPosts.of(terrain, post_size(terrain, options), float(task.upright.origin[2]))
    touched = _touched(task, terrain, posts)
    known = posts.heights[terrain.posts]
    low, high = float(known.min()), max(float(known.max()), float(task.cells.high[:, 2].max()))
    high += _ABOVE * (high - low)
    scale = AltitudeScale.of(low, high)

    def tell(share: float) -> None:
        if deadline.is_up:
            raise CancelledError(
                "the time was up before all tiles were swept, and no set is known before that"
            )
        task.tell_objects(round(share * len(terrain.scene)), len(terrain.scene))

    @cache
    def swept() -> NDArray[np.uint16]:
        # Once: the first cell and those that are timed are asked for before the others.
        return horizons(posts, terrain, scale, high, tell)

    def see(chosen: NDArray[np.int64]) -> Seen:
        found = swept()
        numbers = np.stack(
            [found[x0:x1, y0:y1].min(axis=(0, 1)) for x0, x1, y0, y1 in touched[chosen].tolist()]
        )
        tops = task.cells.high[chosen, 2]
        return Seen(scale.altitudes(numbers) <= tops[:, None], altitudes=numbers)

    yield Sight(
        "voxel-column",
        task.cells,
        see,
        batch=_ALL,
        conservative=True,
        reason="as was asked for" if options.method != "auto" else "since it is a terrain",
        warnings=list,
        altitude_low=scale.low,
        altitude_step=scale.step,
    )


def post_size(terrain: Terrain, options: PvsOptions) -> int:
    """Posts to both sides that one stands for: as many as the epsilon has, by default one."""
    if options.epsilon is None:
        return 1
    most = max(terrain.tile // 2, 1)
    return int(np.clip(options.epsilon / max(terrain.elevation.spacing), 1, most))


def _touched(task: Task, terrain: Terrain, posts: SweepPosts) -> NDArray[np.int64]:
    """(c, 4) int64: the columns that each cell is in, by ranges of :attr:`Terrain.numbers`."""
    cells, rows = task.cells, len(posts.y.stands)
    first = terrain.corner - task.upright.origin[:2]
    low, high = (
        (ends[:, :2] - first) / terrain.elevation.spacing for ends in (cells.low, cells.high)
    )
    edge = _EDGE * max(posts.heights.shape)
    beyond = (low < -edge) | (high > np.array(posts.heights.shape) - 1 + edge)
    if beyond.any():
        raise OptionError(
            f"cell {int(np.flatnonzero(beyond.any(axis=1))[0])} reaches beyond the terrain",
            where="cells", remedy="move it, or choose --method cull-map",
        )  # fmt: skip
    borders = posts.x.ends[1:-1], posts.y.ends[1:-1]
    x0, y0 = (np.searchsorted(borders[i], low[:, i] + edge, "right") for i in (0, 1))
    x1, y1 = (np.searchsorted(borders[i], high[:, i] - edge, "left") for i in (0, 1))
    return np.stack([x0, x1 + 1, rows - 1 - y1, rows - y0], axis=1)


def _check_memory(terrain: Terrain, memory_limit: float | None) -> None:
    sweeps = _POST * terrain.heights.size + _PAIR * terrain.numbers.size * len(terrain.scene)
    need = MemoryNeed({"maps": sweeps}).beside(_LIBRARIES)
    check_need(need, memory_limit, where="tile", advise=lambda limit: "choose larger tiles")
