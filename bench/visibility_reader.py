"""The C reader of visible sets, timed: ``python -m bench.visibility_reader``.

A file of 1,000 cells and 11,700 objects, of which 300 are visible from each cell: in runs, as an
order of near objects gives them, and scattered, the worst that an order can be.  Each object has
an altitude in each cell, and slices where it is visible.  Targets: a cell is found within a
microsecond and a set written within five.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.record import Row
from simplifier.geometry.pvs import SLICES, Altitudes, Pvs, Slices, pack_rows
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_file import save_pvs

CELLS, OBJECTS, VISIBLE = 1000, 11_700, 300
_POINTS = 10_000
_EDGE = 10.0  # metres, of a cell
_HERE = Path(__file__).parent
_HEADERS = _HERE.parent / "integrations" / "c"


def reader_times(
    cells: int = CELLS, objects: int = OBJECTS, visible: int = VISIBLE
) -> Iterator[Row]:
    """A row for each kind of set and task, in microseconds.  Needs a C compiler, ``cc``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = _compiled(folder)
        for kind, run in (("in runs of 5", 5), ("scattered", 1)):
            pvs = made_sets(cells, objects, visible, run)
            save_pvs(pvs, folder / "made.pvs")
            points = np.random.default_rng(1).uniform(
                pvs.cells.low.min(axis=0), pvs.cells.high.max(axis=0), (_POINTS, 3)
            )
            (folder / "points").write_bytes(points.tobytes())
            done = subprocess.run(
                [program, folder / "made.pvs", folder / "points"],
                capture_output=True, text=True, check=True,
            )  # fmt: skip
            for line in done.stdout.splitlines():
                took, task = line.split(" ", 1)
                size = (folder / "made.pvs").stat().st_size
                yield {"visible objects": kind, "bytes": size, "task": task, "us": float(took)}


def made_sets(cells: int, objects: int, visible: int, run: int) -> Pvs:
    """Square cells side by side; from each, other runs of objects are visible."""
    random = np.random.default_rng(0)
    columns = round(cells**0.5)
    places = np.column_stack([np.arange(cells) % columns, np.arange(cells) // columns])
    low = np.column_stack([_EDGE * places, np.zeros(cells)])
    boxes = ViewCells.boxes(low, low + np.array([_EDGE, _EDGE, 3.0]))
    rows, row_of = pack_rows(_some(random, objects, visible, run) for _ in range(cells))
    return Pvs(
        "z", np.zeros(3), tuple(f"object {index}" for index in range(objects)),
        random.permutation(objects).astype(np.int32), boxes,
        rows, row_of, "cull-map", True, bytes(8), bytes(8),
        Slices(visible * np.arange(cells + 1), _values(random, cells * visible)),
        Altitudes(0.0, 0.125, random.integers(0, 99, (cells, objects)).astype(np.uint16)),
    )  # fmt: skip


def _values(random: np.random.Generator, count: int) -> NDArray[np.int8]:
    """(count, 3) slices: the box that is hidden is at either end of one of both axes."""
    values = random.integers(1 - SLICES, SLICES, (count, 3))
    values[:, 2] = np.abs(values[:, 2])
    values[np.arange(count), random.integers(0, 2, count)] = 0
    return values.astype(np.int8)


def _some(random: np.random.Generator, objects: int, visible: int, run: int) -> NDArray[np.bool_]:
    chosen = np.zeros(objects, dtype=np.bool_)
    for begin in random.choice(objects // run, visible // run, replace=False):
        chosen[run * begin : run * (begin + 1)] = True
    return chosen


def _compiled(folder: Path) -> Path:
    program = folder / "visibility_reader"
    compiler = shutil.which("cc") or "cc"
    source = str(_HERE / "visibility_reader.c")
    subprocess.run([compiler, "-O2", f"-I{_HEADERS}", source, "-o", str(program)], check=True)
    return program


def main() -> None:
    """Show the times."""
    parser = argparse.ArgumentParser(prog="python -m bench.visibility_reader", description=__doc__)
    parser.parse_args()
    for row in reader_times():
        print(
            f"{row['us']:9.3f} us  {row['task']} ({row['visible objects']}, {row['bytes']} bytes)"
        )


if __name__ == "__main__":
    main()
