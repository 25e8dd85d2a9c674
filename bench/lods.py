"""Levels of detail of real meshes: ``python -m bench.lods [MESH ...]``.

A table as Markdown, of a cube and of some assets or of the named files: the levels that are kept,
finest first, and why others were left out.  Lengths are shares of the longest edge; recall and
precision from 256 views with all quads counted.  ``docs/decisions/0007`` cites it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import simplifier
from bench.meshes import ASSETS, cube, readable_assets
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracies
from simplifier.geometry.mesh import TriangleMesh
from simplifier.warmup import warm_up

FILES = (
    "bunny_4968.ply",
    "dragon_871k.ply",
    "buddha_113k.ply",
    "building_fzk_haus.glb",
    "city_lyon_buildings.glb",
    "machine_anymal_kinova_395k.glb",
    "terrain_jacksboro_60160.ply",
    "tree_aspen_with_leaves.glb",
)

_COLUMNS = (
    "mesh", "voxels", "triangles", "error bound", "deviation", "from distance", "recall",
    "precision", "left out because",
)  # fmt: skip


def rows(name: str, mesh: TriangleMesh, views: int, **options: Any) -> Iterator[list[str]]:
    """A row a level that was asked for, by falling resolution."""
    begin = time.perf_counter()
    chain = simplifier.simplify(mesh, **{"lods": 3, **options}).chain
    seconds = time.perf_counter() - begin
    occluders = [level.occluder for level in chain.levels]
    judged = evaluate_accuracies(mesh, occluders, AccuracyOptions(views, exact=True))
    edge = float(mesh.extent.max())
    found = [
        (
            level.resolution,
            [
                str(level.triangles), f"{level.error_bound / edge:.4f}",
                f"{level.deviation / edge:.4f}", f"{chain.switch_distance(index) / edge:.1f}",
                f"{report.recall:.1%}", f"{report.precision:.2%}", "",
            ],
        )
        for index, (level, report) in enumerate(zip(chain.levels, judged, strict=True))
    ]  # fmt: skip
    found += [(one.resolution, [*6 * [""], one.reason]) for one in chain.left_out]
    label = f"{name}, {seconds:.1f} s"
    for resolution, cells in sorted(found, key=lambda one: -one[0]):
        yield [label, str(resolution), *cells]
        label = ""


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line and print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.lods", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("meshes", nargs="*", type=Path, help="in place of a cube and some assets")
    parser.add_argument("--lods", type=int, default=4, help="levels to ask for")
    parser.add_argument("--resolution", type=int, default=64, help="of the finest")
    parser.add_argument("--budget", type=int, default=64, help="of the finest")
    parser.add_argument("--views", type=int, default=256, help="that accuracy is measured from")
    given = parser.parse_args(arguments)
    asked = {"lods": given.lods, "resolution": given.resolution, "budget": given.budget}
    warm_up()
    print("| " + " | ".join(_COLUMNS) + " |")
    print("|---" * len(_COLUMNS) + "|")
    if not given.meshes:
        _print(rows("cube", cube(48), given.views, **asked))
    paths = given.meshes or [path for name in FILES if (path := ASSETS / name).exists()]
    for path, standing in readable_assets(paths):
        _print(rows(path.stem, simplifier.load(path), given.views, **asked, **standing))


def _print(lines: Iterator[list[str]]) -> None:
    for line in lines:
        print("| " + " | ".join(line) + " |", flush=True)


if __name__ == "__main__":
    main()
