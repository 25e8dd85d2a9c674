"""What is visible from view cells: ``python -m bench.visibility [--only city|cells|shrinking]``.

    city   cells of 10 m in the streets of a generated city of 2,000 blocks, by epsilon: how large
           their sets are beside what is certainly seen, what is culled, bytes and milliseconds a
           cell, and leaks, of which there must be none
    cells  milliseconds by the number of cells and of objects, and by the cell's size
    shrinking  three ways to shrink occluders: the sets they give, seconds, and memory beside them

Kernels are warm; the height field is made once and counts apart.  Tables go to
``bench/results/visibility_NAME.csv`` and to ``visibility.md``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from bench.record import Row, told, write_page, write_table
from bench.visibility_city import generated_city, street_cells
from bench.visibility_shrinking import shrinking_rows
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_file import encode_pvs
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.check import CheckOptions, check_pvs
from simplifier.visibility.find import Found, find_pvs

RESULTS = Path("bench/results")
TABLES = ("city", "cells", "shrinking")
EPSILONS = (5.0, 2.5)
CELLS = 1000


def city_rows(
    blocks: int = 45, cells: int = CELLS, epsilons: Sequence[float] = EPSILONS, checked: int = 50
) -> Iterator[Row]:
    """A row an epsilon; ``checked`` of the cells are held against what is seen."""
    upright, places = _streets(blocks, cells)
    for epsilon in epsilons:
        options = PvsOptions(up="z", epsilon=epsilon)
        begin = time.perf_counter()
        found = find_pvs(upright, places, options)
        seconds = time.perf_counter() - begin
        check = check_pvs(upright.scene, found.pvs, CheckOptions(checked, 60))
        yield {
            "epsilon": epsilon,
            "cells": cells,
            "objects": len(upright.scene),
            "ms_a_cell": 1e3 * found.seconds,
            "seconds_before": seconds - found.seconds * found.made,
            "sets_to_seen": check.excess,
            "culled": check.culled_share,
            "bytes_a_cell": len(encode_pvs(found.pvs)) / cells,
            "leaks": len(check.leaks),
        }


def cells_rows(blocks: Sequence[int] = (11, 22, 45), cells: int = 200) -> Iterator[Row]:
    """Rows by the city's size, then by the number of cells, then by their size."""
    for some in blocks:
        yield _row(*_streets(some, cells))
    for count in (cells // 4, cells // 2, 2 * cells):
        yield _row(*_streets(max(blocks), count))
    for size in (2.5, 5.0):
        yield _row(*_streets(max(blocks), cells, size), size)


def _row(upright: UprightScene, places: ViewCells, size: float = 10.0) -> Row:
    found = _found(upright, places, size)
    return {
        "objects": len(upright.scene),
        "cells": len(places),
        "cell_size": size,
        "ms_a_cell": 1e3 * found.seconds,
        "seconds": found.seconds * found.made,
    }


def _found(upright: UprightScene, places: ViewCells, size: float) -> Found:
    return find_pvs(upright, places, PvsOptions(up="z", cell_size=size, epsilon=5.0))


def _streets(blocks: int, count: int, size: float = 10.0) -> tuple[UprightScene, ViewCells]:
    city = generated_city(blocks)
    upright = UprightScene.of(city, "z")
    cells = street_cells(city, count, size)
    return upright, ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", choices=TABLES, help="one table alone")
    only = parser.parse_args(words).only
    # Kernels compile on their first call, and arrays of another kind compile them again.
    upright, places = _streets(2, 2)
    check_pvs(upright.scene, _found(upright, places, 10.0).pvs, CheckOptions(1, 4))
    makers = {"city": city_rows, "cells": cells_rows, "shrinking": shrinking_rows}
    for name in TABLES if only is None else (only,):
        rows = []
        for row in makers[name]():
            print(f"{name}: {told(row)}", flush=True)
            rows.append(row)
        write_table(RESULTS / f"visibility_{name}.csv", rows, f"bench.visibility --only {name}")
    write_page(RESULTS, "visibility", TABLES)


if __name__ == "__main__":
    main()
