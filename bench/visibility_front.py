"""Time against tightness: every method in the steps that its options have, in three scenes.

Seconds are those of all processors for the cells, and of voxel columns for the sweeps.  What makes
the scene ready counts apart, since it is the same for any number of cells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.record import Row
from bench.visibility_cases import Case, cells_timed, city, interior, mountains
from simplifier.options.visibility import Method
from simplifier.visibility.checking.check import CheckOptions, check_pvs

_VIEWS = 60  # viewpoints in each cell that is looked from

Steps = Mapping[Method, Sequence[float | None]]
"""Epsilons of each method; None where it has none, or for its default."""


@dataclass(frozen=True)
class Front:
    """``make`` gives a scene, of which so many ``cells`` are taken, and as many ``checked``.

    ``pictures``  viewpoints in each of these that pictures are drawn from, in rooms.
    """

    make: Callable[[], Case]
    steps: Steps
    cells: int
    checked: int
    pictures: int = 0


_CITY = (10.0, 5.0, 2.5, 1.25)
_POSTS = (400.0, 200.0, None)  # four posts, two and one
_ROOMS = (0.8, 0.4, 0.2)

FRONTS: Mapping[str, Front] = {
    "city of 22 x 22 blocks, cells of 10 m": Front(
        lambda: city(22, 100), {"cull-map": _CITY, "strong": (None,), "auto": _CITY}, 100, 50
    ),
    "mountains, a quarter, cells of tiles": Front(
        lambda: mountains(edge=None, share=0.5),
        {"cull-map": (800.0, 400.0, 200.0), "voxel-column": _POSTS}, 1000, 50,
    ),
    "house of two flats, cells of 1 m": Front(
        lambda: interior(0),
        {"cull-map": _ROOMS, "strong": (None,), "slice-wise": _ROOMS}, 60, 20, 6,
    ),
}  # fmt: skip
"""By name.  Slices hide nothing in a city: an object is given up after two thousand shafts."""


def front_rows(fronts: Mapping[str, Front] | None = None) -> Iterator[Row]:
    """A row a scene, method and step; ``leaks`` of slices are what shows through narrow gaps."""
    for scene, front in (FRONTS if fronts is None else fronts).items():
        case = front.make().some(front.cells)
        for method, epsilons in front.steps.items():
            for epsilon in epsilons:
                yield {"scene": scene, "method": method, **_step(case, front, method, epsilon)}


def _step(case: Case, front: Front, method: Method, epsilon: float | None) -> Row:
    options = replace(case.options, method=method, epsilon=epsilon)
    found, seconds = cells_timed(case.upright, case.cells, options, case.terrain)
    look = CheckOptions(front.checked, _VIEWS, pictures=front.pictures, pixels=256)
    check = check_pvs(case.upright.scene, found.pvs, look, terrain=case.terrain)
    cells = len(found.pvs.cells)
    return {
        "step": "" if epsilon is None else f"{epsilon:g} m",
        "taken": " and ".join(found.way),
        "objects": len(case.upright.scene),
        "cells": cells,
        "processor_ms_a_cell": 1e3 * seconds / cells,
        "sets_to_seen": check.excess,
        "mean_set": float(np.mean([found.pvs.visible(cell).sum() for cell in range(cells)])),
        "leaks": len(check.leaks),
    }
