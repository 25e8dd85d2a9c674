"""What got slower, or larger, by a quarter: ``python -m bench.slower [NAME...]``.

Compares the result files of the work tree with those that the last commit kept, figure by figure:
times as ratios to the reference work (:mod:`bench.reference`) or to a kernel's floor, and memory.
Names are those of files in ``bench/results`` without their suffix; all by default.  Prints a line
for each figure that grew by a quarter or more, and then the exit status is 1.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from bench.machine import ROOT
from bench.record import Table, read_table, table_of

RESULTS = ROOT / "bench" / "results"
MEASURED = ("ratio", "wall_ratio", "times_floor", "peak_mib", "work_mib")
"""Columns that are compared."""

NAMES = (
    "start", "scene", "mesh", "triangles", "resolution", "budget", "preset", "quads", "kernel",
    "unit", "peer",
)  # fmt: skip
"""Columns that tell which figure a row is."""

_MORE = 1.25


def grown(kept: Table, found: Table) -> Iterator[str]:
    """A line for each figure of ``found`` that is a quarter above the one of that name kept."""
    before = dict(_figures(kept))
    for name, value in _figures(found):
        known = before.get(name, 0.0)
        if known > 0.0 and value >= _MORE * known:
            row, column = name
            times = f"{value / known:.2f} times"
            yield f"{row}: {column} {known:.4g} -> {value:.4g}, {times}"


def _figures(table: Table) -> Iterator[tuple[tuple[str, str], float]]:
    """By row and column.  Rows that :data:`NAMES` do not tell apart are told by their order."""
    seen: Counter[str] = Counter()
    for cells in table.rows:
        row: Mapping[str, str] = dict(zip(table.columns, cells, strict=True))
        name = ", ".join(row[column] for column in NAMES if row.get(column))
        seen[name] += 1
        if seen[name] > 1 or not name:
            name = f"{name}, row {seen[name]}".removeprefix(", ")
        for column in MEASURED:
            if row.get(column):
                yield (name, column), float(row[column])


def _kept(path: Path) -> Table | None:
    """The file as the last commit has it."""
    place = f"HEAD:{path.relative_to(ROOT).as_posix()}"
    done = subprocess.run(["git", "show", place], cwd=ROOT, capture_output=True, text=True)
    return table_of(done.stdout) if done.returncode == 0 else None


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse the command line, print what grew; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.slower", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("names", nargs="*", help="result files, all if none is named")
    given = parser.parse_args(arguments)
    paths = [RESULTS / f"{name}.csv" for name in given.names] or sorted(RESULTS.glob("*.csv"))
    lines = []
    for path in paths:
        kept = _kept(path)
        if kept is not None:
            lines += [f"{path.stem}: {line}" for line in grown(kept, read_table(path))]
    print("\n".join(lines) or "nothing got slower or larger by a quarter")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
