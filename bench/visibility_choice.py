"""What ``occluder pvs --method auto`` takes of each scene, beside each method that can serve.

All seconds are those of all processors, the scene made ready included, so that they tell something
on a busy machine as well.  They are the least of three rounds in turn: what shares the caches of
the processor makes a run up to a fifth longer, and the first run of all loads what others share.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from unittest.mock import patch

import numpy as np

from bench.record import Row
from bench.visibility_cases import CASES, Case, city
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.elevation import Elevation
from simplifier.options.visibility import Method, PvsOptions
from simplifier.visibility.find import METHODS, Found, find_pvs
from simplifier.visibility.placing.terrain_cells import place_columns
from simplifier.visibility.solid.terrain import Terrain

_CELLS = 24
_ROUNDS = 3
_EQUAL = 1.02  # times the mean set of auto: a method with more is not as tight
_LEFT_OUT: Mapping[str, tuple[str, ...]] = {
    "city of 45 x 45 blocks": ("slice-wise",),
    "Lyon": ("slice-wise",),
    "3,324 boxes": ("slice-wise",),
}
"""Methods that take many minutes for sets several times as large."""

_WHOLE = ("mountains, a quarter, cells of tiles",)
"""All cells of these: voxel columns sweep for all of them or for none."""


def choice_rows(names: Sequence[str] | None = None, most: int = _CELLS) -> Iterator[Row]:
    """A row a scene, of those that are named; at most so many cells of each, by lot.

    ``time_to_best``  auto's seconds to the least of all methods whose sets are as small as its own
                      or smaller, and conservative if its own are.
    ``foretold_to_came``  what auto foretold of its seconds in all, to what it took.

    Methods that the scene is refused by have no seconds, nor have those that take too long.
    """
    _warm()
    for name, make in CASES.items():
        if names is not None and name not in names:
            continue
        case = make() if name in _WHOLE else make().some(most)
        by = _rounds(case, [method for method in METHODS if method not in _LEFT_OUT.get(name, ())])
        found, seconds = by.pop("auto")
        foretold = found.foretold or found.cost
        yield {
            "scene": name,
            "objects": len(case.upright.scene),
            "cells": found.made,
            "taken": " and ".join(found.way),
            "sentence": found.reason,
            "foretold_seconds": foretold.seconds,
            "came_seconds": found.cost.seconds,
            "foretold_to_came": foretold.seconds / found.cost.seconds,
            "time_to_best": seconds / _best(found, seconds, by.values()),
            "auto_seconds": seconds,
            "auto_set": _mean_set(found),
            **_columns(by),
        }


def _rounds(case: Case, methods: Sequence[str]) -> dict[str, tuple[Found, float]]:
    """The fastest run of auto and of each method that the scene is not refused by."""
    least: dict[str, tuple[Found, float]] = {}
    for _ in range(_ROUNDS):
        for method in ("auto", *methods):
            timed = _served(case, method)
            if timed and (method not in least or timed[1] < least[method][1]):
                least[method] = timed
    return least


def _warm() -> None:
    """Load the kernels of every method."""
    posts = Elevation(np.zeros((9, 9)), (10.0, 10.0), (0.0, 0.0))
    terrain = Terrain.of(posts, 4)
    options = PvsOptions(up="z", cell_size=40.0)
    ground = UprightScene.of(terrain.scene, "z")
    places = place_columns(terrain, ground, "grid", options)
    for case in (city(3, 4), Case(ground, places, options, terrain)):
        for method in METHODS:
            _served(case, method)


def _served(case: Case, method: str) -> tuple[Found, float] | None:
    try:
        return _timed(case, method)
    except OptionError:
        return None


def _timed(case: Case, method: str) -> tuple[Found, float]:
    """The sets and the seconds; what the run foretells is by the same clock."""
    options = replace(case.options, method=_method(method))
    with patch("time.perf_counter", time.process_time):
        begin = time.process_time()
        found = find_pvs(case.upright, case.cells, options, terrain=case.terrain)
        return found, time.process_time() - begin


def _best(found: Found, seconds: float, others: Iterable[tuple[Found, float]]) -> float:
    """The least seconds of what is as tight and as sure."""
    most = _EQUAL * _mean_set(found)
    return min(
        [seconds]
        + [
            took
            for one, took in others
            if _mean_set(one) <= most and one.pvs.conservative >= found.pvs.conservative
        ]
    )


def _columns(by: Mapping[str, tuple[Found, float]]) -> Row:
    row: dict[str, object] = {}
    for method, (found, seconds) in by.items():
        row |= {f"{method}_seconds": seconds, f"{method}_set": _mean_set(found)}
    return row


def _method(name: str) -> Method:
    return name  # type: ignore[return-value]


def _mean_set(found: Found) -> float:
    return float(np.mean([found.pvs.visible(cell).sum() for cell in found.pvs.computed.tolist()]))
