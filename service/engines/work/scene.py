"""A scene of many objects to a tree of occluders."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import simplifier
from service.engines.messages import Task
from service.engines.work.archive import unpack, unpacked_folder
from service.engines.work.meter import Meter
from service.engines.work.refusals import input_path, without_paths
from service.engines.worker import Cancel, TaskCancelledError, Tell
from service.jobs.job import Summary


def make_scene(task: Task, tell: Tell, cancel: Cancel) -> Summary:
    """Results: ``scene.json``, its occluders, ``preview.glb``, and ``scene.zip`` with all of them.

    Raises as :data:`~service.engines.worker.Work` says, and :class:`simplifier.OccluderError`.
    """
    meter, results = Meter(tell), Path(task.results)
    options = {**_checked(task), "preview": True}
    meter.at("load", 0.0)
    scene = _load(task)

    def told(done: int, total: int) -> None:
        meter.at("occluders", 0.1 + 0.8 * done / max(total, 1))

    simplifier.simplify_scene(scene, results, **options, tell=told, cancel=cancel)
    if cancel.is_set():
        raise TaskCancelledError
    meter.at("write", 0.9)
    _pack(results)
    document = json.loads((results / "scene.json").read_text("utf-8"))
    occluders = document["occluders"].values()
    return Summary(
        triangles=sum(one["triangles"] for one in occluders),
        input_triangles=int(scene.triangle_counts.sum()),
        levels=len(occluders),
        seconds=meter.seconds,
        warnings=tuple(document["warnings"]),
    )


def _checked(task: Task) -> dict[str, Any]:
    """The options by keyword, each known and of its kind; the library checks how they agree."""
    fields = {field.name: field for field in simplifier.SCENE_FIELDS}
    for name, value in task.options.items():
        if name not in fields:
            raise simplifier.OptionError(
                "there is no such option", where=name, remedy=f"choose from {', '.join(fields)}"
            )
        fields[name].check(value)
    return dict(task.options)


def _load(task: Task) -> simplifier.Scene:
    """Of one file, which may not refer to others, or of an archive, within which files may."""
    path = input_path(task, "scene")
    if path.suffix.lower() == ".zip":
        folder = unpacked_folder(task)
        folder.mkdir()
        unpack(path, folder, task.unpacked)
        scene = simplifier.load_scene(folder)
    else:
        scene = simplifier.load_scene(path, allow_external=False)
    return replace(scene, warnings=tuple(without_paths(one, task) for one in scene.warnings))


def _pack(results: Path) -> None:
    """An archive of all results so far; the same results give the same bytes."""
    files = sorted(path for path in results.rglob("*") if path.is_file())
    with zipfile.ZipFile(results / "scene.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            entry = zipfile.ZipInfo(path.relative_to(results).as_posix())
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
