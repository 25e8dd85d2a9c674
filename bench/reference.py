"""A fixed piece of work beside which figures are kept, since machines differ.

It is nobody's code that is measured: fast-simplification of the dragon to a tenth of its triangles,
on one core.  A figure's ``ratio`` is its seconds over those of this work in the same run, and
:mod:`bench.slower` compares ratios.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module

import numpy as np

from bench.meshes import load_stand_in, stand_in_named
from bench.peers import missing
from bench.record import Row

_PEER = "fast-simplification"
_TIMINGS = 3
_LEFT_OUT = 0.9  # of the triangles


def reference_seconds() -> float | None:
    """CPU seconds of the work, the median of some; None where the mesh or the library is absent."""
    dragon = stand_in_named("dragon_871k")
    if dragon.missing or missing(_PEER):
        return None
    mesh = load_stand_in(dragon)
    points, faces = np.array(mesh.vertices), np.array(mesh.faces)
    simplify = import_module("fast_simplification").simplify

    def took() -> float:
        begin = time.process_time()
        simplify(points, faces, target_reduction=_LEFT_OUT)
        return time.process_time() - begin

    took()  # its first pass fetches the pages
    return statistics.median(took() for _ in range(_TIMINGS))


def with_ratios(
    rows: Iterable[Row], columns: Mapping[str, str], around: Iterable[float | None]
) -> list[Row]:
    """The rows with ratios to the mean of some reference times.

    ``columns`` names the ratio for each column of seconds, behind which it comes.  Where a
    reference time is missing the rows stay as they are.
    """
    known = list(around)
    if None in known:
        return list(rows)
    reference = statistics.mean(one for one in known if one is not None)
    return [dict(_with_ratios(row, columns, reference)) for row in rows]


def remark(around: Iterable[float | None]) -> str:
    """What a result file says of its reference."""
    told = ", ".join("absent" if one is None else f"{one:.3f} s" for one in around)
    return f"reference: {_PEER} of the dragon to a tenth, before and after: {told}"


def _with_ratios(
    row: Row, columns: Mapping[str, str], reference: float
) -> Iterator[tuple[str, object]]:
    for name, value in row.items():
        yield name, value
        if name in columns and isinstance(value, float):
            yield columns[name], value / reference
