"""How much is hidden at how little overhang: ``python -m bench.overhang [MESH ...]``.

A table as Markdown, a row a mesh: recall at overhang in the mean and in the worst view, and front
in the mean and in the worst view, by preset and by what is asked for (``--presets balanced,best``,
``--overhangs 0.005,0.05``).  256 views that
no search has seen, all quads counted, no option but the budget, the up axis and ``--front``;
seconds and CPU seconds from the mesh in memory to its triangles, kernels warm.  ``--seeds N``: the
least and the most recall over as many seeds in place of one.  If no mesh is named, all rows go to
``bench/results/overhang_SHARES.csv`` as well.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

import simplifier
from bench.meshes import ASSETS
from bench.quality import RESULTS
from bench.record import Row, write_table
from bench.robustness import from_least_to_most
from simplifier.geometry.mesh import TriangleMesh
from tests.extremes.shapes import SHAPES

MESHES = {
    "bunny_4968.ply": (53, "y"),
    "dragon_871k.ply": (36, "y"),
    "buddha_113k.ply": (30, "y"),
    "machine_anymal_kinova_395k.glb": (36, "y"),
    "terrain_jacksboro_60160.ply": (23, "z"),
    "broken_lyon_palais_de_justice.ply": (64, "y"),
    "cad_reciprocating_saw.glb": (64, "y"),
    "bunny_69k.ply": (64, "y"),
    "level_dungeon.ply": (64, "y"),
    "broken_truck.ply": (64, "y"),
    "Menger sponge": (64, "z"),
}
"""Budget and up axis, of assets and of the tests' sponge."""


def load(name: str) -> TriangleMesh | None:
    """None of an asset that is not there."""
    if name in SHAPES:
        return SHAPES[name]()
    path = ASSETS / name
    return simplifier.load(path) if path.exists() else None


def measured(mesh: TriangleMesh, **options: object) -> Row:
    """What an occluder of these options is worth, in percent, and what it took."""
    begin, work = time.perf_counter(), time.process_time()
    made = simplifier.simplify(mesh, **options)
    seconds, work = time.perf_counter() - begin, time.process_time() - work
    found = simplifier.evaluate(mesh, made.occluder, exact=True)
    over, front = found.overhang, found.front
    return {
        "recall": f"{100 * found.recall:.2f}",
        "beside": f"{100 * over.mean:.2f}",
        "beside worst": f"{100 * over.worst:.1f}",
        "front": f"{100 * front.mean:.2f}",
        "front worst": f"{100 * front.worst:.1f}",
        "precision": f"{100 * found.precision:.2f}",
        "seconds": f"{seconds:.1f}",
        "CPU seconds": f"{work:.1f}",
    }


def cell(runs: Sequence[Row]) -> str:
    """Of one seed all figures; of several the least and the most recall."""
    if len(runs) > 1:
        return from_least_to_most([float(str(run["recall"])) for run in runs])
    (run,) = runs
    return (
        f"{float(str(run['recall'])):.1f} at {run['beside']} ({run['beside worst']}),"
        f" front {run['front']} ({run['front worst']}),"
        f" precision {run['precision']}, {run['seconds']} s ({run['CPU seconds']})"
    )


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("meshes", nargs="*", help="parts of their names; all without")
    parser.add_argument("--presets", default="balanced,best")
    parser.add_argument("--overhangs", default="0.005")
    parser.add_argument("--front", type=float, default=1.0)
    parser.add_argument("--seeds", type=int, default=1)
    given = parser.parse_args(words)
    simplifier.warm_up()
    columns = [
        (preset, float(overhang))
        for overhang in given.overhangs.split(",")
        for preset in given.presets.split(",")
    ]
    print("| mesh, budget | " + " | ".join(f"{one}, {share:g}" for one, share in columns) + " |")
    print("|---" * (len(columns) + 1) + "|")
    rows: list[Row] = []
    for name, (budget, up) in MESHES.items():
        if given.meshes and not any(part in name for part in given.meshes):
            continue
        mesh = load(name)
        if mesh is None:
            continue
        cells = []
        for preset, overhang in columns:
            asked = {"budget": budget, "up": up, "preset": preset, "overhang": overhang}
            runs = [
                measured(mesh, **asked, front=given.front, seed=seed) for seed in range(given.seeds)
            ]
            shared = {"mesh": name.partition(".")[0], **asked}
            rows += [{**shared, "seed": seed, **run} for seed, run in enumerate(runs)]
            cells.append(cell(runs))
        print(f"| {name.partition('.')[0]}, {budget} | {' | '.join(cells)} |", flush=True)
    if not given.meshes:
        command = " ".join(["python -m bench.overhang", *(words or sys.argv[1:])])
        write_table(RESULTS / f"overhang_{given.overhangs.replace(',', '_')}.csv", rows, command)


if __name__ == "__main__":
    main()
