"""The report of an occluder made elsewhere, against its mesh."""

from __future__ import annotations

from pathlib import Path

import simplifier
from service.engines.messages import Task
from service.engines.work.inputs import input_path, options_within_memory, read_mesh
from service.engines.work.meter import JUDGING, Meter
from service.engines.work.report_files import (
    PICTURE_SIZE,
    command_names,
    summary_of,
    write_report,
    write_thumbnail,
)
from service.engines.worker import Cancel, ReportProgress, TaskCancelledError
from service.jobs.job import Summary
from service.jobs.on_demand import FINEST, ORIGINAL
from service.keep import Keep


def evaluate_mesh(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: a report; both meshes to look at, ``original.glb`` and ``lod0.glb``, and a
    thumbnail, unless little is kept.

    Raises as :data:`~service.engines.worker.DoTask` says, and :class:`simplifier.OccluderError`.
    """
    meter = Meter(tell)
    options = simplifier.EvaluateOptions.of(options_within_memory(task))
    meter.at("load", 0.0)
    simplifier.check_file(input_path(task, "mesh"), options, pictures=True, viewing=True)
    mesh, overrides = read_mesh(task, options)
    occluder = simplifier.load_occluder(
        input_path(task, "occluder"), allow_external=False, memory_limit=options.memory_limit
    )
    load_seconds = meter.seconds
    listener = meter.part(0.1, 0.8, JUDGING)
    found = simplifier.evaluate(
        mesh, occluder, options, listener=listener, cancel=cancel, overrides=overrides
    )
    if cancel.is_set():
        raise TaskCancelledError
    meter.at("write", 0.8)
    report = found.report(load_seconds=load_seconds, names=command_names(task.name))
    results = Path(task.results)
    write_report(found, report, task)
    if task.keep is not Keep.LEAN:
        simplifier.save_for_viewing(mesh, results / ORIGINAL)
        simplifier.save(occluder, results / FINEST)
        view = simplifier.Viewpoint(mesh, size=PICTURE_SIZE, up=options.up)
        write_thumbnail(view, occluder, task)
    return summary_of(report, 1, meter.seconds)
