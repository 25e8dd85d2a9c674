"""What is visible from view cells: ``python -m bench.visibility [--only NAME]``.

    city   cells of 10 m in the streets of a generated city of 2,000 blocks, by epsilon, by cull
           maps alone and by what auto takes: how large their sets are beside what is certainly
           seen, what is culled, bytes and milliseconds a cell, and leaks, which must be none
    cells  milliseconds, also of all cores together, peak memory and bytes a cell, by the number of
           cells and of objects, by epsilon and by the cell's size
    lyon   the same as city, for street cells of a part of Lyon on a slope; needs the shared assets
    rooms  walkable cells of 1 m on all floors of three shared interiors, by slices; needs the
           shared assets.  Only when asked for
    terrain  columns over the tiles of a shared elevation model: by sweeps, as published, and by
           cull maps, beside lines of sight all around.  Only when asked for
    slices  street cells as of city, with slices of buildings: the share of triangles that is
           still drawn, milliseconds and bytes a cell, and leaks.  Only when asked for
    shrunk_faces  occluders of any shape shrunk for a cell, by faces that move and by a grid that is
           eroded, and sets by shafts, in the interiors of rooms.  Only when asked for
    shrinking  three ways to shrink occluders: the sets they give, seconds, and memory beside them
    strong  the tables of the paper on strong occluders, beside what it prints: strong_city (its 1
           and 2), strong_ranks (3), strong_levels (4) and strong_spheres (5)
    choice  what auto takes of nine scenes, its sentence, what it foretells and what comes, beside
           each method that can serve, by processor time.  Needs the shared assets; only when
           asked for
    front  time a cell against sets to what is seen, each method in steps, in a city, on a terrain
           and in a house.  Needs the shared assets; only when asked for
    oracle  slices beside blocker extension, which the tests alone have (Schaufler et al. 2000):
           sets and processor time in two small scenes of boxes.  Only when asked for
    walks  triangles drawn along walks of 600 frames through seven scenes by sets, by occluders and
           by both.  Needs the shared assets; only when asked for
    check  100,000 viewpoints of the generated city that look past silhouettes, and 2,000 that draw
           item buffers on six faces: leaks, of which there must be none.  Long: only when asked for

``city``, ``cells`` and ``lyon`` are of cull maps alone, ``check`` is of what auto takes.
Kernels are warm; the height field is made once and counts apart.  Tables go to
``bench/results/visibility_NAME.csv`` and to ``visibility.md``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from bench.point import forget_peak, resident_mib
from bench.record import Row, tell_parts, told, write_page, write_table
from bench.visibility_cases import cells_timed
from bench.visibility_choice import choice_rows
from bench.visibility_city import streets
from bench.visibility_front import front_rows
from bench.visibility_oracle import oracle_rows
from bench.visibility_plot import plot_cells, plot_front
from bench.visibility_rooms import rooms_rows
from bench.visibility_shrinking import shrinking_rows
from bench.visibility_shrunk_faces import shrunk_face_rows
from bench.visibility_slices import slices_table
from bench.visibility_strong import city_rows as strong_city_rows
from bench.visibility_strong import level_rows, rank_rows, sphere_rows
from bench.visibility_terrain import terrain_rows
from bench.visibility_walks import walk_rows
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.pvs import Pvs
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_file import encode_pvs
from simplifier.io.scene import load_scene
from simplifier.options.visibility import Method, PvsOptions
from simplifier.progress import TellCount, TellShare
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.cells import place_cells

RESULTS = Path("bench/results")
STRONG = ("strong_city", "strong_ranks", "strong_levels", "strong_spheres")
TABLES = ("city", "cells", "lyon", "shrinking", *STRONG)
ALL = (
    *TABLES,
    "front",
    "slices",
    "shrunk_faces",
    "rooms",
    "terrain",
    "choice",
    "walks",
    "oracle",
    "check",
)
PLOTS = {"cells": plot_cells, "front": plot_front}
LYON = Path("../shared/assets/city_lyon_buildings.glb")
EPSILONS = (20.0, 10.0, 5.0, 2.5)
CELLS = 1000


def city_rows(
    blocks: int = 45, cells: int = CELLS, epsilons: Sequence[float] = EPSILONS, checked: int = 50
) -> Iterator[Row]:
    """A row an epsilon and method; ``checked`` of the cells are held against what is seen."""
    upright, places = streets(blocks, cells)
    methods: tuple[Method, ...] = ("cull-map", "auto")
    for epsilon, method in product(epsilons, methods):
        options = PvsOptions(up="z", method=method, epsilon=epsilon)
        yield {
            "epsilon": epsilon,
            "method": method,
            **_judged(upright, places, options, checked),
        }


def lyon_rows(
    path: Path = LYON, count: int = 300, epsilons: Sequence[float] = (5.0, 2.5), checked: int = 50
) -> Iterator[Row]:
    """A row an epsilon; the cells are drawn by lot from all on which one can walk."""
    upright = UprightScene.of(load_scene(path), "z")
    for epsilon in epsilons:
        options = PvsOptions(
            up="z", method="cull-map", ground=True, epsilon=epsilon, skip_buried=True
        )
        places = place_cells(upright, "walkable", options)
        sizes = places.high - places.low
        lots = np.random.default_rng(0).permutation(len(places))[:count]
        yield {
            "epsilon": epsilon,
            "all_cells": len(places),
            "all_area": float(np.prod(sizes[:, :2], axis=1).sum()),
            "mean_height": float(np.mean(sizes[:, 2])),
            **_judged(upright, places.some(np.sort(lots)), options, checked),
        }


def _judged(
    upright: UprightScene, places: ViewCells, options: PvsOptions, checked: int = 50
) -> Row:
    forget_peak()
    begin = time.perf_counter()
    found, processor = cells_timed(upright, places, options)
    seconds = time.perf_counter() - begin
    peak = resident_mib("VmHWM")
    check = check_pvs(upright.scene, found.pvs, CheckOptions(checked, 60))
    return {
        "cells": len(found.pvs.cells),
        "objects": len(upright.scene),
        "ms_a_cell": 1e3 * found.seconds,
        "processor_ms_a_cell": 1e3 * processor / len(places),
        "seconds_before": seconds - found.seconds * found.made,
        "peak_gib": peak / 1024.0,
        "sets_to_seen": check.excess,
        "culled": culled_share(found.pvs),
        "bytes_a_cell": len(encode_pvs(found.pvs)) / len(found.pvs.cells),
        "leaks": len(check.leaks),
    }


def cells_rows(
    blocks: Sequence[int] = (6, 11, 22, 45),
    cells: Sequence[int] = (50, 100, 200, 400, 800),
    epsilons: Sequence[float] = (1.25, 2.5, 5.0),
    sizes: Sequence[float] = (2.5, 5.0, 10.0),
) -> Iterator[Row]:
    """Rows by the number of cells and of objects, by epsilon and by the cells' size.

    What does not vary is 200 cells of 10 m, an epsilon of 5 m and a city of 22 x 22 blocks, or the
    middle of what is given.
    """
    middle, some = blocks[-2], cells[len(cells) // 2]
    for count in cells:
        yield _row("cells", *streets(middle, count))
    for wide in blocks:
        yield _row("objects", *streets(wide, some))
    for epsilon in epsilons:
        yield _row("epsilon", *streets(middle, some), epsilon=epsilon)
    for size in sizes:
        yield _row("cell_size", *streets(middle, some, size), size)


def _row(
    varied: str, upright: UprightScene, places: ViewCells, size: float = 10.0, epsilon: float = 5.0
) -> Row:
    options = PvsOptions(up="z", method="cull-map", cell_size=size, epsilon=epsilon)
    forget_peak()
    found, processor = cells_timed(upright, places, options)
    return {
        "varied": varied,
        "objects": len(upright.scene),
        "cells": len(places),
        "cell_size": size,
        "epsilon": epsilon,
        "ms_a_cell": 1e3 * found.seconds,
        "processor_ms_a_cell": 1e3 * processor / len(places),
        "processor_seconds": processor,
        "peak_mib": resident_mib("VmHWM"),
        "bytes_a_cell": len(encode_pvs(found.pvs)) / len(places),
        "culled": culled_share(found.pvs),
    }


def culled_share(pvs: Pvs) -> float:
    """The share of objects that are not in the sets, a mean over the cells."""
    return 1.0 - float(np.mean([pvs.visible(cell).mean() for cell in pvs.computed.tolist()]))


def check_rows(
    blocks: int = 45, cells: int = CELLS, views: int = 100, lines: int = 1000, pictures: int = 2
) -> Iterator[Row]:
    """A row for lines and one for pictures: ``views`` and ``pictures`` viewpoints a cell.

    Each viewpoint looks along ``lines`` directions, and past the corners of what is seen or near.
    """
    upright, places = streets(blocks, cells)
    found = find_pvs(upright, places, PvsOptions(up="z"))
    for what, options in (
        ("lines", CheckOptions(cells, views, azimuths=lines, seed=1)),
        ("pictures", CheckOptions(cells, pictures, azimuths=0, pictures=pictures, seed=2)),
    ):
        begin = time.perf_counter()
        tell = _told_share(tell_parts(f"check: {what}, cells"), cells)
        check = check_pvs(upright.scene, found.pvs, options, tell)
        yield {
            "by": what,
            "cells": len(check.rows),
            "viewpoints": len(check.rows) * options.views,
            "seconds": time.perf_counter() - begin,
            "sets_to_seen": check.excess,
            "leaks": len(check.leaks),
        }


def _told_share(tell: TellCount, total: int) -> TellShare:
    return lambda share: tell(round(share * total), total)


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", choices=(*ALL, "strong"), help="one table alone")
    only = parser.parse_args(words).only
    # Kernels compile on their first call, and arrays of another kind compile them again.
    upright, places = streets(2, 2)
    check_pvs(upright.scene, find_pvs(upright, places, PvsOptions(up="z")).pvs, CheckOptions(1, 4))
    makers = {
        "city": city_rows,
        "cells": cells_rows,
        "lyon": lyon_rows,
        "shrinking": shrinking_rows,
        "strong_city": strong_city_rows,
        "strong_ranks": rank_rows,
        "strong_levels": level_rows,
        "strong_spheres": sphere_rows,
        "check": check_rows,
        "rooms": rooms_rows,
        "terrain": terrain_rows,
        "slices": slices_table,
        "shrunk_faces": shrunk_face_rows,
        "choice": choice_rows,
        "front": front_rows,
        "walks": walk_rows,
        "oracle": oracle_rows,
    }
    for name in {None: TABLES, "strong": STRONG}.get(only, (only,)):
        rows = []
        for row in makers[name]():
            print(f"{name}: {told(row)}", flush=True)
            rows.append(row)
        command = f"bench.visibility --only {name}"
        write_table(RESULTS / f"visibility_{name}.csv", rows, command)
        if name in PLOTS:
            PLOTS[name](RESULTS / f"visibility_{name}.png", rows, command)
    write_page(RESULTS, "visibility", ALL)


if __name__ == "__main__":
    main()
