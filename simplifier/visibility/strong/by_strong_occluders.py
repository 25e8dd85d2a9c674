"""Scene + ViewCells -> what no strong occluder hides: the method of single convex occluders."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.hull_rays import NO_PIECES, VOLUME
from simplifier.visibility.method import Seen, Sight, Task, better, check_plain, without_buried
from simplifier.visibility.solid.buried import within_objects
from simplifier.visibility.strong.convex_bodies import ConvexBodies
from simplifier.visibility.strong.scene_occluders import occluders_of
from simplifier.visibility.strong.strong_occluders import Tactics, TwoLevels, cell_of

_BATCH = 32  # cells between two looks at the clock
_LOST = 0.2  # share of what is solid that may hide nothing without a word
_WIDE = 1.0  # of the occluders' median width: larger cells than that are told of


@contextmanager
def by_strong_occluders(task: Task) -> Iterator[Sight]:
    """Convex parts of the objects, each by itself.

    Raises :class:`OptionError` where there are none, for cells that lie in one of them wholly
    unless they are skipped, and for terrains and options that only cull maps have.
    """
    check_plain(task, "strong occluders")
    found = occluders_of(task.upright, task.options.ground, task.tell_objects, task.opaque)
    buried = _buried(task.cells, found.occluders.bodies)
    hiding = task.upright if task.opaque is None else task.upright.with_scene(task.opaque)
    # The boxes in what is not convex hide each other's side of it, from a viewer between them.
    buried |= within_objects(hiding, task.cells)
    cells = without_buried(task, buried, lambda cell: "an object")
    tactics = Tactics(pieces=NO_PIECES) if task.looked_at_again else Tactics()
    levels = TwoLevels(found.occluders, cells, tactics)

    def warnings() -> list[str]:
        told = []
        if 1.0 - found.kept > _LOST:
            told.append(
                f"{100.0 * (1.0 - found.kept):.0f} % of what is solid is in no convex part of an"
                f" object, and hides nothing{better(task)}"
            )
        sides = (found.occluders.bodies.boxes[:, 1] - found.occluders.bodies.boxes[:, 0])[:, :2]
        solid = found.occluders.bodies.kinds == VOLUME
        width = float(np.median(np.where(solid, sides.min(axis=1), sides.max(axis=1))))
        size = float(np.median((cells.high - cells.low)[:, :2].max(axis=1)))
        if size > _WIDE * width:
            told.append(
                f"half of the occluders are narrower than {width:.3g}, and hide little from cells"
                f" of {size:.3g}; try smaller cells, or --method cull-map"
            )
        return told

    yield Sight(
        "strong-occluders",
        cells,
        partial(_seen, levels),
        batch=_BATCH,
        portable=True,
        conservative=True,
        reason="as was asked for",
        warnings=warnings,
        occluders=found.occluders,
    )


def _seen(levels: TwoLevels, chosen: NDArray[np.int64]) -> Seen:
    return Seen(~levels.hidden(chosen))


def _buried(cells: ViewCells, bodies: ConvexBodies) -> BoolArray:
    """(c,) whether each cell lies in a convex body."""
    buried: BoolArray = np.zeros(len(cells), dtype=np.bool_)
    for cell in range(len(cells)):
        low, high = cells.low[cell], cells.high[cell]
        around = (bodies.boxes[:, 0] <= low).all(axis=1) & (bodies.boxes[:, 1] >= high).all(axis=1)
        corners = cell_of(cells, cell, 0.0)[0]
        for body in np.flatnonzero(around & (bodies.kinds == VOLUME)).tolist():
            planes = bodies.planes[bodies.starts[body] : bodies.starts[body + 1]]
            buried[cell] |= bool((corners @ planes[:, :3].T <= planes[:, 3]).all())
    return buried
