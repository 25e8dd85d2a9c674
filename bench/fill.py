"""What counts as inside, and what it is worth: ``python -m bench.fill [MESH ...]``.

Two tables as Markdown, of the assets or of those that are named, with no option but the fill.

    worth   recall at precision of the balanced preset in 64 triangles, from 128 views with all
            quads counted: by flood fill, and by sight at several tolerances
    time    seconds of flood fill and of sight fill by resolution, medians of three
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from statistics import median

import simplifier
from bench.meshes import readable_assets
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options.stages import SolidOptions, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.voxel.fill import fill
from simplifier.voxel.sight import fill_unseen
from simplifier.voxel.voxelize import voxelize

TOLERANCES = (0.0, 0.02, 0.05, 0.1, 0.2)
RESOLUTIONS = (64, 128, 256, 512)


def worth(mesh: TriangleMesh, tolerance: float | None) -> str:
    """Recall and precision at a tolerance; by flood fill with None."""
    options = make_options(float(mesh.extent.max()))
    chosen = {"fill": "flood"} if tolerance is None else {"tolerance": tolerance}
    made = simplify_mesh(mesh, replace(options, solid=replace(options.solid, **chosen)))
    found = evaluate_accuracy(mesh, made.occluder, AccuracyOptions(views=128, exact=True))
    return f"{100.0 * found.recall:.1f} at {100.0 * found.precision:.2f}"


def seconds(mesh: TriangleMesh, resolution: int) -> tuple[float, float]:
    """Of flood fill, and of sight fill after it."""
    touched = voxelize(mesh, resolution)
    flooding, looking = [], []
    for _ in range(3):
        begin = time.perf_counter()
        flooded = fill(touched)
        middle = time.perf_counter()
        fill_unseen(touched, flooded, SolidOptions().tolerance)
        flooding.append(middle - begin)
        looking.append(time.perf_counter() - middle)
    return median(flooding), median(looking)


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("meshes", nargs="*", help="names of assets; all without")
    asked = parser.parse_args(words)
    assets = [
        path for path, _ in readable_assets() if not asked.meshes or path.stem in asked.meshes
    ]
    simplifier.warm_up()
    kinds = ["flood", *(f"sight, {one:g}" for one in TOLERANCES)]
    print(f"| mesh | {' | '.join(kinds)} |\n|---|{'---|' * len(kinds)}")
    for path in assets:
        mesh = simplifier.load(path)
        cells = [worth(mesh, one) for one in (None, *TOLERANCES)]
        print(f"| {path.stem} | {' | '.join(cells)} |", flush=True)
    kinds = [f"{one} voxels: flood, sight" for one in RESOLUTIONS]
    print(f"\n| mesh | {' | '.join(kinds)} |\n|---|{'---|' * len(kinds)}")
    for path in assets:
        mesh = simplifier.load(path)
        times = [seconds(mesh, one) for one in RESOLUTIONS]
        cells = [f"{1e3 * flood:.0f} ms, {1e3 * sight:.0f} ms" for flood, sight in times]
        print(f"| {path.stem} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
