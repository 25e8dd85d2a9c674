"""A real result, made once: files as a job leaves them."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import simplifier
from bench.visibility_city import generated_city
from examples.castle import castle
from service.engines.messages import Task
from service.engines.work.occluder import make_occluder
from service.engines.work.scene import make_scene
from service.engines.work.visibility import find_sets
from service.jobs.job import JobKind, Summary
from service.keep import Keep
from simplifier.io.scene_writer import write_scene

DRAFT: Mapping[str, Any] = {
    "preset": "draft", "lods": 2, "ground": True, "resolution": 32, "views": 64, "overhang": 0.02,
}  # fmt: skip


@dataclass(frozen=True)
class JobResult:
    """What a job has made, of the castle if not said otherwise, and what it was made of.

    ``part``  of the upload that the input came as.
    """

    options: Mapping[str, Any]
    input: Path
    folder: Path
    summary: Summary
    kind: JobKind = JobKind.OCCLUDER
    part: str = "mesh"
    keep: Keep = Keep.ALL

    @property
    def report(self) -> dict[str, Any]:
        told: dict[str, Any] = json.loads((self.folder / "report.json").read_text())
        return told

    def occluder(self, level: int) -> simplifier.Occluder:
        return simplifier.load_occluder(self.folder / f"lod{level}.glb")


def castle_result(folder: Path, keep: Keep = Keep.ALL, **changes: Any) -> JobResult:
    """Made in this process by the function that workers call."""
    options = {**DRAFT, **changes}
    mesh, results, scratch = folder / "castle.ply", folder / "results", folder / "scratch"
    results.mkdir(parents=True)
    scratch.mkdir()
    whole = castle()
    simplifier.save(simplifier.Occluder(whole.vertices, whole.faces, error_bound=0.0), mesh)
    task = Task(
        JobKind.OCCLUDER, "castle.ply", options, {"mesh": str(mesh)}, str(results), str(scratch),
        threads=1, memory=1 << 32, unpacked=1 << 30, keep=keep, pages=keep is Keep.ALL,
    )  # fmt: skip
    summary = make_occluder(task, lambda progress: None, threading.Event())
    return JobResult(options, mesh, results, summary, keep=keep)


def sets_result(folder: Path, **changes: Any) -> JobResult:
    """The visible sets of a small town, made in the same way."""
    write_scene(generated_city(2), folder / "town.glb")
    return _found_sets(folder, "town.glb", {"up": "z", "ground": True, **changes})


def terrain_result(folder: Path) -> JobResult:
    """The visible sets of tiles on either side of a ridge, with altitudes."""
    heights = np.zeros((40, 40))
    heights[:, 18:23] = 60.0
    np.save(folder / "ridge.npy", heights)
    options = {"spacing": [10.0, 10.0], "tile": 8, "method": "voxel-column", "cell_size": 80.0}
    return _found_sets(folder, "ridge.npy", {**options, "eye_height": 100.0})


def _found_sets(folder: Path, name: str, options: Mapping[str, Any]) -> JobResult:
    """Of a scene in the folder."""
    scene, results, scratch = folder / name, folder / "results", folder / "scratch"
    results.mkdir(parents=True)
    scratch.mkdir()
    task = Task(
        JobKind.VISIBILITY, name, options, {"scene": str(scene)}, str(results), str(scratch),
        threads=1, memory=1 << 32, unpacked=1 << 30,
    )  # fmt: skip
    summary = find_sets(task, lambda progress: None, threading.Event())
    return JobResult(options, scene, results, summary, JobKind.VISIBILITY, "scene")


def scene_result(folder: Path) -> JobResult:
    """The occluders of a small town, made in the same way."""
    write_scene(generated_city(4), folder / "town.glb")
    results, scratch = folder / "results", folder / "scratch"
    results.mkdir(parents=True)
    scratch.mkdir()
    options = {"up": "z", "ground": True, "resolution": 16, "moves": 50}
    task = Task(
        JobKind.SCENE, "town.glb", options, {"scene": str(folder / "town.glb")}, str(results),
        str(scratch), threads=1, memory=1 << 32, unpacked=1 << 30,
    )  # fmt: skip
    summary = make_scene(task, lambda progress: None, threading.Event())
    return JobResult(options, folder / "town.glb", results, summary, JobKind.SCENE, "scene")
