"""How much is hidden at how little overhang: ``python -m bench.overhang [MESH ...]``.

A table as Markdown, a row a mesh: recall at overhang in the mean and in the worst view, and front
in the mean and in the worst view, by preset and by what is asked for (``--presets balanced,best``,
``--overhangs 0.005,0.05``).  256 views that
no search has seen, all quads counted, no option but the budget, the up axis and ``--front``;
seconds and CPU seconds from the mesh in memory to its triangles, kernels warm.  ``--seeds N``: the
least and the most recall over as many seeds in place of one.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import simplifier
from bench.meshes import ASSETS
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


def cell(mesh: TriangleMesh, **options: object) -> tuple[float, str]:
    """The recall, and what a cell of the table says."""
    begin, work = time.perf_counter(), time.process_time()
    made = simplifier.simplify(mesh, **options)
    seconds, work = time.perf_counter() - begin, time.process_time() - work
    found = simplifier.evaluate(mesh, made.occluder, exact=True)
    over, front = found.overhang, found.front
    return found.recall, (
        f"{100 * found.recall:.1f} at {100 * over.mean:.2f} ({100 * over.worst:.1f}),"
        f" front {100 * front.mean:.2f} ({100 * front.worst:.1f}),"
        f" precision {100 * found.precision:.2f}, {seconds:.1f} s ({work:.1f})"
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
    for name, (budget, up) in MESHES.items():
        if given.meshes and not any(part in name for part in given.meshes):
            continue
        mesh = load(name)
        if mesh is None:
            continue
        cells = []
        for preset, overhang in columns:
            runs = [
                cell(
                    mesh,
                    budget=budget,
                    up=up,
                    preset=preset,
                    overhang=overhang,
                    seed=seed,
                    front=given.front,
                )
                for seed in range(given.seeds)
            ]
            spread = from_least_to_most([100 * recall for recall, _ in runs])
            cells.append(runs[0][1] if given.seeds == 1 else spread)
        print(f"| {name.partition('.')[0]}, {budget} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
