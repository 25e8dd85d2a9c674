"""What a task was given: files and what their owner calls them, overrides, and how much memory.

Messages name files as their owner does: no path of this machine is among them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import simplifier
from service.engines.messages import Task
from service.engines.work.archive import unpack
from service.engines.worker import TaskFailedError
from service.jobs.job import Failure

_OVERRIDES = "overrides"

MeshOptions = simplifier.SimplifyOptions | simplifier.EvaluateOptions | simplifier.TradeoffOptions

_GIB = 1 << 30


def read_mesh(
    task: Task, options: MeshOptions
) -> tuple[simplifier.TriangleMesh, simplifier.Overrides]:
    """The mesh without what the overrides ignore, and these; empty where none came.

    Raises :class:`simplifier.OccluderError`.
    """
    overrides = simplifier.Overrides()
    if _OVERRIDES in task.inputs:
        label = input_label(task, _OVERRIDES)
        overrides = simplifier.load_overrides(task.inputs[_OVERRIDES], name=label)
    mesh = simplifier.load(
        input_path(task, "mesh"),
        allow_external=False,
        transparent=options.transparent,
        ignore=overrides.ignore,
        memory_limit=options.memory_limit,
    )
    return mesh, overrides


def input_path(task: Task, name: str) -> Path:
    """The path of an input of the task; raises :class:`TaskFailedError` when there is none."""
    if name not in task.inputs:
        raise TaskFailedError(Failure("unreadable-mesh", f"no {name} was given", f"send a {name}"))
    return Path(task.inputs[name])


def scene_path(task: Task) -> Path:
    """The scene's file, which may refer to no other, or the folder of an archive, whose files may.

    Raises as :func:`input_path` and :func:`~service.engines.work.archive.unpack` do.
    """
    path = input_path(task, "scene")
    if path.suffix.lower() != ".zip":
        return path
    folder = unpacked_folder(task)
    folder.mkdir()
    unpack(path, folder, task.unpacked)
    return folder


def task_memory(task: Task) -> int:
    """Bytes that it may take beside what its process has; its owner may have set less."""
    own = task.options.get("memory_limit")
    return task.memory if own is None else min(int(own * _GIB), task.memory)


def whole_memory(task: Task) -> float:
    """GiB of the whole process, a warm one."""
    return (simplifier.BASE_BYTES + task_memory(task)) / _GIB


def options_within_memory(task: Task) -> dict[str, Any]:
    """The task's, with that limit."""
    return {**task.options, "memory_limit": whole_memory(task)}


def without_paths(text: str, task: Task) -> str:
    """Files by the names that their owner knows."""
    for name, path in task.inputs.items():
        text = text.replace(path, input_label(task, name))
    return text.replace(str(unpacked_folder(task)), task.name)


def input_label(task: Task, name: str) -> str:
    """What messages call an input: an occluder may be called as its mesh is."""
    match name:
        case "occluder":
            return name
        case "overrides":
            return task.labels.get(name, "overrides.toml")
        case _:
            return task.name


def unpacked_folder(task: Task) -> Path:
    """The folder that the archive of a task is unpacked to."""
    return Path(task.scratch) / "unpacked"
