"""Blocker extension, which the tests have as an oracle, beside slices: two small scenes of boxes.

Schaufler et al., "Conservative Volumetric Visibility with Occluder Fusion" (2000).  It is plain
NumPy, so that its seconds tell how it grows rather than how fast it could be.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from bench.record import Row
from tests.visibility.oracles.blocker_extension import visible_boxes
from tests.visibility.oracles.scenes import SCENES, Corners, Small, dotted
from tests.visibility.rooms import found_names, sampled_names

_DOTS = 200  # small boxes by lot, of which sets tell how much space is open
_LINES = 20_000  # at once, from each cell
_TIMES = 10


def oracle_rows(dots: int = _DOTS, times: int = _TIMES) -> Iterator[Row]:
    """A row a scene and method, with voxels as large as the scene's grid and half as large."""
    for name, make in SCENES.items():
        small = dotted(make(), dots)
        seen = [_seen(small, cell, times) for cell in small.cells]
        for parts in (1, 2):
            voxel = small.voxel / parts
            for method, find in (
                ("blocker extension", _by_blockers),
                ("slice-wise", _by_slices),
            ):
                find(small, voxel, small.cells[0])  # kernels are warm
                yield {
                    "scene": name,
                    "method": method,
                    "voxel": voxel,
                    "objects": len(small.boxes),
                    **_judged(small, seen, partial(find, small, voxel)),
                }


def _by_blockers(small: Small, voxel: float, cell: Corners) -> set[str]:
    visible = visible_boxes(np.array(list(small.boxes.values())), np.array(cell), voxel)
    return {name for name, one in zip(small.boxes, visible, strict=True) if one}


def _by_slices(small: Small, voxel: float, cell: Corners) -> set[str]:
    return set(found_names(small.boxes, cell, epsilon=5.0 * voxel))


def _seen(small: Small, cell: Corners, times: int) -> set[str]:
    random = np.random.default_rng(0)
    found = (sampled_names(small.boxes, cell, _LINES, random) for _ in range(times))
    return set().union(*found)


def _judged(
    small: Small, seen: Sequence[set[str]], find: Callable[[Corners], set[str]]
) -> dict[str, float]:
    begin = time.process_time()
    sets = [find(cell) for cell in small.cells]
    seconds = (time.process_time() - begin) / len(sets)
    visible = sum(map(len, sets))
    return {
        "visible": visible / len(sets),
        "sets_to_seen": visible / sum(map(len, seen)),
        "leaks": sum(len(some - found) for some, found in zip(seen, sets, strict=True)),
        "processor_seconds_a_cell": seconds,
    }
