"""Scenes of many objects: ``python -m bench.scenes [--only PART] [--scene NAME]``.

    build    a first build, one without and one with a changed object: time, peak memory
    cull     walks and flights: what is hidden, found and hidden wrongly; a table a path, by frame
    closed   the same on a city of closed buildings, built with --conservative: nothing wrongly
    growth   time and peak memory of a first build against the number of instanced objects
    dense    500 buildings of 2.3 million triangles: near occluders beside other ways to make them

Scenes are the shared ones and a generated city.  Times are wall clock of the whole command, all
processors, kernels warm; ``cpu`` in a name is processor time of all its processes.
``scenes_PART.csv`` hold the figures, ``scenes.md`` shows them all.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log
from pathlib import Path

import numpy as np

from bench.dense import dense_rows
from bench.dense_city import dense, some_buildings
from bench.machine import ROOT
from bench.meshes import ASSETS
from bench.plot import plot_scene_growth
from bench.process_tree import Run, run_command
from bench.record import Row, told, write_page, write_table
from examples.city import city
from simplifier.camera_paths.generate import generate_path
from simplifier.culling.flythrough import Flythrough, fly
from simplifier.culling.flythrough_rows import flythrough_csv
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.scene_file import load_occluder_tree
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import CullOptions, PathKind, PathOptions
from simplifier.options.simplify import Axis

RESULTS = Path("bench/results")
WORK = ROOT / "out" / "bench"  # scenes and builds, made again each time
FRAMES = 60
GROWTH = (100, 300, 1000, 3000, 10_000, 30_000, 100_000)
# A node costs the same whatever the scene, so little of it saves an hour.
_GROWTH_OPTIONS = ("--ground", "--resolution", "16", "--moves", "300")


@dataclass(frozen=True)
class BenchScene:
    """A scene and how it is built and looked at; ``file`` of the assets, or a generated city."""

    name: str
    file: str | int
    up: Axis
    ground: bool
    kinds: tuple[PathKind, ...]

    @property
    def options(self) -> list[str]:
        return ["--up", self.up, *(["--ground"] if self.ground else [])]

    def load(self) -> Scene:
        if isinstance(self.file, int):
            return city(self.file)
        return load_scene(ASSETS / self.file)


SCENES = (
    BenchScene("lyon", "city_lyon_buildings.glb", "z", True, ("street", "roof")),
    BenchScene("city", 10_000, "y", True, ("street", "roof")),
    BenchScene("sponza", "sponza_dabrovic.glb", "y", False, ("inside",)),
    BenchScene("dungeon", "level_dungeon.ply", "y", False, ("inside",)),
    BenchScene("duplex", "building_duplex.glb", "z", False, ("inside", "street")),
    BenchScene("fzk_haus", "building_fzk_haus.glb", "z", False, ("inside", "street")),
)


def build_rows(scenes: Sequence[BenchScene]) -> Iterator[Row]:
    """Three builds of each: the first, the same again, and with one object grown by a tenth."""
    for one in scenes:
        scene = one.load()
        source, folder = WORK / f"{one.name}.glb", _fresh(one.name)
        write_scene(scene, source)
        first = _build(source, folder, one.options)
        again = _build(source, folder, one.options)
        write_scene(_changed(scene), source)
        changed = _build(source, folder, one.options)
        made = next(line for line in changed.output.splitlines() if "made now" in line)
        tree = load_occluder_tree(folder)
        yield {
            "scene": one.name, "objects": len(scene), "parts": len(tree.object_of),
            "triangles": int(scene.triangle_counts.sum()), "nodes": len(tree.tree),
            "occluders": len(tree.occluders),
            "occluder_triangles": sum(len(occluder.faces) for occluder in tree.occluders),
            "first_s": first.seconds, "first_cpu_s": first.cpu_seconds, "peak_mib": first.peak_mib,
            "unchanged_s": again.seconds, "unchanged_cpu_s": again.cpu_seconds,
            "changed_s": changed.seconds, "changed_cpu_s": changed.cpu_seconds,
            "changed_share": changed.seconds / first.seconds,
            "made_again": made.split("│")[2].split(",")[0].strip(),
        }  # fmt: skip


def cull_rows(scenes: Sequence[BenchScene], folder: Path) -> Iterator[Row]:
    """Every path of each scene, from a build of its own."""
    for one in scenes:
        yield from _flown(one, one.name, one.options, folder)


def closed_rows(scenes: Sequence[BenchScene], folder: Path) -> Iterator[Row]:
    """A city of closed meshes, built to keep wholly inside and drawn by inner coverage."""
    del scenes
    small = BenchScene("closed_city", 1000, "y", False, ("street", "roof"))
    yield from _flown(small, small.name, [*small.options, "--conservative"], folder)


def growth_rows(scenes: Sequence[BenchScene]) -> Iterator[Row]:
    """Cities of instanced buildings; slope of log time over log objects, from row to row."""
    del scenes
    before: tuple[int, float, float] | None = None
    for count in GROWTH:
        scene = city(count)
        source, folder = WORK / "growth.glb", _fresh("growth")
        write_scene(scene, source)
        run = _build(source, folder, _GROWTH_OPTIONS)
        here = (len(scene), run.seconds, run.peak_mib)
        row: dict[str, object] = {
            "objects": len(scene), "triangles": int(scene.triangle_counts.sum()),
            "first_s": run.seconds, "peak_mib": run.peak_mib,
            "ms_a_nlogn": 1000.0 * run.seconds / (len(scene) * log(len(scene))),
        }  # fmt: skip
        if before is not None:
            run_of = log(here[0] / before[0])
            row["time_slope"] = log(here[1] / before[1]) / run_of
            row["memory_slope"] = log(here[2] / before[2]) / run_of
        yield row
        before = here


def city_rows() -> Iterator[Row]:
    """A walk through buildings of the first scene, which leads past them as they were."""
    source = some_buildings(SCENES[0].load())
    yield from dense_rows(dense(source), generate_path(source, PathOptions("street", 40, "z")))


def _fresh(name: str) -> Path:
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def _build(source: Path, folder: Path, options: Sequence[str]) -> Run:
    command = [sys.executable, "-m", "simplifier", "scene", str(source), "-o", str(folder)]
    return run_command([*command, *options])


def _changed(scene: Scene) -> Scene:
    """The object in the middle grown by a tenth, in its own mesh."""
    index = len(scene) // 2
    mesh = scene.meshes[scene.mesh_of[index]]
    middle = mesh.bounds.mean(axis=0)
    grown = TriangleMesh((mesh.vertices - middle) * 1.1 + middle, mesh.faces)
    mesh_of = scene.mesh_of.copy()
    mesh_of[index] = len(scene.meshes)
    return Scene((*scene.meshes, grown), scene.names, mesh_of, scene.transforms)


def _flown(one: BenchScene, name: str, options: Sequence[str], folder: Path) -> Iterator[Row]:
    scene = one.load()
    source, built = WORK / f"{name}.glb", _fresh(name)
    write_scene(scene, source)
    _build(source, built, options)
    scene, tree = load_scene(source), load_occluder_tree(built)
    for kind in one.kinds:
        path = generate_path(scene, PathOptions(kind, FRAMES, one.up))
        flown = fly(scene, tree, path, CullOptions(shots=0))
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"cull_{name}_{kind}.csv").write_bytes(flythrough_csv(flown))
        yield {"scene": name, "path": kind, **_totals(flown)}


def _totals(flown: Flythrough) -> Row:
    total, frames = flown.total, [frame.figures for frame in flown.frames]
    worst = flown.worst_recall
    return {
        "frames": len(frames), "parts_hidden": total.parts.hidden,
        "recall": total.parts.recall, "objects_recall": total.objects.recall,
        "worst_recall": None if worst is None else worst.figures.parts.recall,
        "wrong_share": total.wrong_share, "wrong_share_worst": max(f.wrong_share for f in frames),
        "wrong_parts": total.parts.wrong,
        "triangle_share": total.triangle_share,
        "triangle_share_worst": max(f.triangle_share for f in frames),
        "ms": float(np.median([f.milliseconds for f in frames])),
    }  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line and run the parts."""
    parser = argparse.ArgumentParser(prog="python -m bench.scenes", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--only", choices=PARTS, action="append", help="a part; may be repeated")
    parser.add_argument(
        "--scene", choices=[one.name for one in SCENES], action="append", help="may be repeated"
    )
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder of the results")
    given = parser.parse_args(arguments)
    scenes = [one for one in SCENES if given.scene is None or one.name in given.scene]
    WORK.mkdir(parents=True, exist_ok=True)
    for name in given.only or PARTS:
        command = f"python -m bench.scenes --only {name}"
        rows = []
        for row in PARTS[name](scenes, given.output):
            rows.append(row)
            print(f"{name}: {told(row)}", flush=True)
        path = given.output / f"scenes_{name}.csv"
        write_table(path, rows, command)
        if name == "growth":
            plot_scene_growth(path.with_suffix(".png"), rows, command)
    print(write_page(given.output, "scenes", PARTS))


PARTS: Mapping[str, Callable[[Sequence[BenchScene], Path], Iterator[Row]]] = {
    "build": lambda scenes, folder: build_rows(scenes),
    "cull": cull_rows,
    "closed": closed_rows,
    "growth": lambda scenes, folder: growth_rows(scenes),
    "dense": lambda scenes, folder: city_rows(),
}


if __name__ == "__main__":
    main()
