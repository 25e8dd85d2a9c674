"""A scene of many objects to a tree of occluders."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import simplifier
from service.engines.messages import Task
from service.engines.work.archive import unpack
from service.engines.work.inputs import (
    input_path,
    options_within_memory,
    scene_path,
    whole_memory,
    without_paths,
)
from service.engines.work.meter import Meter
from service.engines.worker import Cancel, ReportProgress, TaskCancelledError
from service.jobs.job import Summary
from service.jobs.on_demand import OCCLUDERS


def make_scene(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: ``scene.json``, the same with all occluders in one file for engines, ``scene.occs``,
    ``preview.glb``, and ``scene.zip`` with these and each occluder by itself.

    Of the last there may be thousands, too many for each to be a file of the job.  Raises as
    :data:`~service.engines.worker.DoTask` says, and :class:`simplifier.OccluderError`.
    """
    meter, results = Meter(tell), Path(task.results)
    folder = Path(task.scratch) / "scene"
    options = simplifier.SceneOptions.of({**options_within_memory(task), "preview": True})
    meter.at("load", 0.0)
    scene = _load(task)
    meter.at("occluders", 0.1)

    def report_objects(done: int, total: int) -> None:
        meter.at("occluders", 0.1 + 0.8 * done / max(total, 1))

    simplifier.simplify_scene(scene, folder, options, tell=report_objects, cancel=cancel)
    if cancel.is_set():
        raise TaskCancelledError
    meter.at("write", 0.9)
    _pack(folder, results / OCCLUDERS)
    for name in ("scene.json", "scene.occs", "preview.glb"):
        (folder / name).replace(results / name)
    document = json.loads((results / "scene.json").read_text("utf-8"))
    occluders = document["occluders"].values()
    return Summary(
        triangles=sum(one["triangles"] for one in occluders),
        input_triangles=int(scene.triangle_counts.sum()),
        levels=len(occluders),
        seconds=meter.seconds,
        warnings=tuple(document["warnings"]),
    )


def record_walk(task: Task, cancel: Cancel) -> bytes:
    """A walk through the scene and its occluders, which were made before; raises as above."""
    folder = Path(task.scratch) / "occluders"
    folder.mkdir()
    unpack(input_path(task, OCCLUDERS), folder, task.unpacked)
    tree = simplifier.load_occluder_tree(folder)
    return simplifier.record_walk(_load(task), tree, name=task.name, cancel=cancel)


def _load(task: Task) -> simplifier.Scene:
    """The scene of one file, which may refer to no other, or of an archive, whose files may."""
    path = scene_path(task)
    scene = simplifier.load_scene(
        path, allow_external=path.is_dir(), memory_limit=whole_memory(task)
    )
    return replace(scene, warnings=tuple(without_paths(one, task) for one in scene.warnings))


def _pack(folder: Path, target: Path) -> None:
    """An archive of all files of a folder; the same files give the same bytes."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            entry = zipfile.ZipInfo(path.relative_to(folder).as_posix())
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
