"""How time and peak memory grow: against triangles, against resolution, against budget.

Each point is the median over the repeats (three at most) in a process of its own, kernels warm.
The slope of a row is that of log(time) over log(what grows), from the row before to this one: 0 is
constant, 1 linear, 3 cubic.  ``extra_mib`` is what the work needs beyond what was resident before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from bench.point import measure
from bench.record import Row
from bench.times import stages

_MOST_REPEATS = 3  # points are many, and their neighbours show what is noise


@dataclass(frozen=True)
class Growth:
    """One thing that grows (``column``) and the meshes that it is tried on; else 64 of each."""

    column: str
    values: tuple[int, ...]
    meshes: tuple[str, ...]

    def rows(self, repeats: int) -> Iterator[Row]:
        """A row for each mesh and value, smallest first."""
        for mesh in self.meshes:
            before: Row | None = None
            for value in self.values:
                row = _point(mesh, self.column, value, min(repeats, _MOST_REPEATS))
                yield {**row, "slope": _slope(before, row, self.column)}
                before = row


TRIANGLES = Growth(
    "triangles", (1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000, 4_000_000), ("bumpy",)
)
RESOLUTION = Growth("resolution", (16, 32, 64, 128, 256), ("bumpy-100000", "castle"))
BUDGET = Growth("budget", (8, 16, 32, 64, 128, 256, 512), ("castle",))


def fitted_slopes(rows: Sequence[Row], column: str, quantity: str) -> dict[str, float]:
    """For each mesh the slope of a straight line through all its points, both axes logarithmic."""
    found = {}
    for mesh in dict.fromkeys(str(row["mesh"]) for row in rows):
        mine = [row for row in rows if row["mesh"] == mesh]
        x, y = ([float(str(row[name])) for row in mine] for name in (column, quantity))
        if len(mine) > 1:
            found[mesh] = float(np.polyfit(np.log(x), np.log(y), 1)[0])
    return found


def _point(mesh: str, column: str, value: int, repeats: int) -> Row:
    name = f"{mesh}-{value}" if column == "triangles" else mesh
    given = {"budget": 64, "resolution": 64, "ground": mesh == "castle"}
    options = given if column == "triangles" else {**given, column: value}
    point = measure("simplify", name, repeats, **options)
    return {
        "mesh": mesh, column: value, **point.summary, "work_mib": point.work_mib,
        "extra_mib": point.work_mib - point.before_mib, "process_mib": point.process_mib,
        **stages(point),
    }  # fmt: skip


def _slope(before: Row | None, row: Row, column: str) -> float | None:
    if before is None:
        return None
    rise, run = (
        log(float(str(row[name])) / float(str(before[name]))) for name in ("median_s", column)
    )
    return rise / run
