"""How long everything takes and how much memory: ``python -m bench.speed [--only PART]``.

    stand_ins          mesh in memory to occluder, by preset and stage; targets 0.3, 1 and 5 s
    limits             time limits asked for, taken, and the recall that they give
    accuracy           the report of 256 views; target 1.5 s for 100,000 triangles
    growth_triangles   time and memory against the triangles of the mesh
    growth_resolution  against the voxels along the longest edge
    growth_budget      against the triangles allowed
    memory             peak of a whole run at 256 voxels a side; target 1 GiB
    kernels            single kernels beside their floors and their peers
    culling            occluders drawn and boxes tested; target 10 ms for 10,000 of each
    devices            pictures and scores by the processor and by OpenGL, with its renderer's name

Starts of whole processes are measured by ``python -m bench.start``.

Times are wall clock with all processors and kernels warm, the median over the repeats with the
least and the most beside it (``kernels``, ``culling``: one processor); ``ratio`` is the median over
the time of the reference work in the same run (:mod:`bench.reference`).  Every part writes
``speed_PART.csv``, growth also a picture, and ``speed.md`` shows all that the folder holds.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from bench.culling import culling_times
from bench.devices import device_times
from bench.growth import BUDGET, RESOLUTION, TRIANGLES, Growth, fitted_slopes
from bench.kernels import kernel_times
from bench.plot import plot_growth
from bench.record import Row, told, write_page, write_table
from bench.reference import reference_seconds, remark, with_ratios
from bench.times import accuracy_times, limit_times, memory_at_256, occluder_times

RESULTS = Path("bench/results")

Part = Callable[[int], Iterator[Row]]

GROWTHS = {f"growth_{growth.column}": growth for growth in (TRIANGLES, RESOLUTION, BUDGET)}
PARTS: Mapping[str, Part] = {
    "stand_ins": occluder_times,
    "limits": limit_times,
    "accuracy": accuracy_times,
    **{name: growth.rows for name, growth in GROWTHS.items()},
    "memory": memory_at_256,
    "kernels": kernel_times,
    "culling": culling_times,
    "devices": device_times,
}


def run_part(name: str, part: Part, repeats: int, folder: Path, command: str) -> Path:
    """Measure one part, print its rows as they come, and write its files; returns the CSV."""
    rows: list[Row] = []
    around = [reference_seconds()]
    for row in part(repeats):
        rows.append(row)
        print(f"{name}: {told(row)}", flush=True)
    around.append(reference_seconds())
    rows = with_ratios(rows, {"median_s": "ratio"}, around)
    path = folder / f"speed_{name}.csv"
    write_table(path, rows, command, remark(around), *_slopes(name, rows))
    if name in GROWTHS:
        plot_growth(path.with_suffix(".png"), rows, GROWTHS[name].column, command)
    return path


def _slopes(name: str, rows: Sequence[Row]) -> Iterator[str]:
    """Remarks about a growth: the slope over all its points."""
    growth: Growth | None = GROWTHS.get(name)
    if growth is None:
        return
    for quantity, title in (("median_s", "time"), ("work_mib", "memory")):
        for mesh, slope in fitted_slopes(rows, growth.column, quantity).items():
            line = f"{mesh}: {title} grows as {growth.column} to the power of {slope:.2f}, fitted"
            print(line)
            yield line


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line and run the parts."""
    parser = argparse.ArgumentParser(prog="python -m bench.speed", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--only", choices=PARTS, action="append", help="a part; may be repeated")
    parser.add_argument("--repeats", type=int, default=5, help="timings of each point (5)")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder of the results")
    given = parser.parse_args(arguments)
    if given.repeats < 1:
        parser.error("--repeats: give 1 or more")
    for name in given.only or PARTS:
        command = f"python -m bench.speed --only {name} --repeats {given.repeats}"
        run_part(name, PARTS[name], given.repeats, given.output, command)
    print(write_page(given.output, "speed", PARTS))


if __name__ == "__main__":
    main()
