"""A scene to what may be seen from each view cell of it."""

from __future__ import annotations

import json
from pathlib import Path

import simplifier
from service.engines.messages import Task
from service.engines.work.inputs import options_within_memory, scene_path, without_paths
from service.engines.work.meter import Meter
from service.engines.work.set_view import write_view
from service.engines.worker import Cancel, ReportProgress, TaskCancelledError
from service.jobs.job import Summary


def find_sets(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: ``sets.pvs``, ``report.json``, ``cells.png``, and in ``view/`` what the page shows.

    Raises as :data:`~service.engines.worker.DoTask` says, and :class:`simplifier.OccluderError`.
    """
    meter, results = Meter(tell), Path(task.results)
    timings: dict[str, float] = {}

    def at_objects(done: int, total: int) -> None:
        timings.setdefault("load", meter.seconds)
        meter.at_count("objects", 0.1 + 0.2 * done / max(total, 1), done, total)

    def at_cells(done: int, total: int) -> None:
        timings.setdefault("load", meter.seconds)
        timings.setdefault("objects", meter.seconds - sum(timings.values()))
        meter.at_count("sets", 0.3 + 0.6 * done / max(total, 1), done, total)

    meter.at("load", 0.0)
    path = scene_path(task)
    made = simplifier.find_visible_sets(
        path, simplifier.VisibilityOptions.of(options_within_memory(task)),
        allow_external=path.is_dir(), tell_objects=at_objects, tell=at_cells, cancel=cancel,
    )  # fmt: skip
    if cancel.is_set():  # what is done by then is no result here
        raise TaskCancelledError
    timings["sets"] = meter.seconds - sum(timings.values())
    meter.at("write", 0.9)
    made.save(results / "sets.pvs")
    report = json.dumps(made.report(), indent=2, allow_nan=False)
    (results / "report.json").write_text(report + "\n", "utf-8")
    (results / "cells.png").write_bytes(made.cells_picture(task.name))
    write_view(made, results / "view")
    timings["write"] = meter.seconds - sum(timings.values())
    return Summary(
        triangles=0,
        input_triangles=int(made.upright.scene.triangle_counts.sum()),
        levels=len(made.pvs.cells),
        seconds=meter.seconds,
        timings=timings,
        warnings=tuple(without_paths(one, task) for one in made.warnings),
    )
