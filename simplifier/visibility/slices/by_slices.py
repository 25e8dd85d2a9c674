"""Scene + ViewCells -> what slices leave open, for rooms, bridges and all without one height."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OptionError
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.method import Seen, Sight, Task, better, check_plain
from simplifier.visibility.slices.shafts import Shafts, Targets, see_by_shafts
from simplifier.visibility.slices.slices import Grid, open_share, slices_of

_BATCH = 2  # cells between two looks at the clock
_FINE = 0.2  # of epsilon: a voxel
_MOST_VOXELS = 120_000_000  # three GiB of slices
_LOST = 0.2  # share of the surface that may be in no slice without a word


@contextmanager
def by_slices(task: Task) -> Iterator[Sight]:
    """Shafts between cells and objects, closed by slices through what hides, and by open sheets.

    Raises :class:`OptionError` for terrains and options that only cull maps have, and for an
    epsilon that would take too many voxels.
    """
    upright, cells, options, opaque = task.upright, task.cells, task.options, task.opaque
    check_plain(task, "slices")
    grid = Grid.around(upright, _FINE * options.reach)
    refused = too_many_voxels(task)
    if refused is not None:
        raise refused
    hiding = upright if opaque is None else upright.with_scene(opaque)
    slices = slices_of(hiding, grid, cells)
    shafts = Shafts.of(slices, Targets.of(upright, grid, task.tell_objects))
    told = [
        "what shows through gaps between closed objects that are smaller than"
        f" {0.5 * grid.cell:.3g} both ways may be missing, and the file is not called conservative"
    ]
    if slices.halls:
        told.append(
            f"viewers are in {slices.halls:,} of the closed surfaces: of these only what is flat"
            " across an axis is in a slice"
        )
    if slices.lost > _LOST:
        told.append(
            f"{100.0 * slices.lost:.0f} % of the surface is neither that of closed objects nor flat"
            f" across an axis, and hides only what it parts from the cell by itself{better(task)}"
        )
    yield Sight(
        "slice-wise",
        cells,
        partial(_seen, shafts, cells, options.seed),
        batch=_BATCH,
        portable=True,
        conservative=False,
        reason="as was asked for",
        warnings=lambda: told,
    )


def _seen(shafts: Shafts, cells: ViewCells, seed: int, chosen: NDArray[np.int64]) -> Seen:
    return Seen(see_by_shafts(shafts, cells.some(chosen), seed=seed)[0])


def open_surface(task: Task) -> float:
    """The share of the surface that hides nothing by slices, 0 to 1."""
    hiding = task.upright if task.opaque is None else task.upright.with_scene(task.opaque)
    grid = Grid.around(task.upright, _FINE * task.options.reach)
    return open_share(hiding, grid, task.cells)


def too_many_voxels(task: Task) -> OptionError | None:
    """What refuses an epsilon that would take more voxels than there is room for."""
    reach = task.options.reach
    grid = Grid.around(task.upright, _FINE * reach)
    voxels = float(np.prod(grid.shape.astype(np.float64)))
    if voxels <= _MOST_VOXELS:
        return None
    least = reach * (voxels / _MOST_VOXELS) ** (1.0 / 3.0)
    return OptionError(
        f"{reach:g} would make {voxels:,.0f} voxels", where="epsilon",
        remedy=f"choose {np.ceil(1e3 * least) / 1e3:.6g} or more, or --method auto",
    )  # fmt: skip
