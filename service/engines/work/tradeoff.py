"""What more time buys on a mesh: the library's sweep over many settings."""

from __future__ import annotations

from pathlib import Path

import simplifier
from service.engines.messages import Task
from service.engines.work.inputs import options_within_memory, read_mesh
from service.engines.work.meter import Meter
from service.engines.worker import Cancel, ReportProgress, TaskCancelledError, TaskFailedError
from service.jobs.job import Failure, Summary

_MEASURED = 0.95  # of the job: the rest is pictures


def measure_tradeoff(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: ``tradeoff.csv``, ``.json``, ``.png`` and ``.html``.

    Raises as :data:`~service.engines.worker.DoTask` says, and :class:`simplifier.OccluderError`.
    """
    meter, results = Meter(tell), Path(task.results)
    options = simplifier.TradeoffOptions.of(options_within_memory(task))
    meter.at("load", 0.0)
    mesh, overrides = read_mesh(task, options)
    meter.at("runs", 0.0)

    begin = meter.seconds

    def report_runs(done: int, runs: int, now: str) -> None:
        spent = (meter.seconds - begin) / options.within if options.within else 0.0
        meter.at_count("runs", _MEASURED * min(max(done / runs, spent), 1.0), done, runs)

    study = simplifier.sweep_tradeoff(
        mesh, options, name=task.name, tell=report_runs, cancel=cancel, overrides=overrides,
        journal=task.journal,
    )  # fmt: skip
    for name, data in study.files():
        if cancel.is_set():
            raise TaskCancelledError
        (results / name).write_bytes(data)
    return _summary(study, len(mesh.faces), meter.seconds)


def _summary(study: simplifier.Study, input_triangles: int, seconds: float) -> Summary:
    """The numbers of the setting that recalls most; raises :class:`TaskFailedError` without any."""
    measured = [row for row in study.rows if row["standing"] != "failed"]
    if not measured:
        raise TaskFailedError(
            Failure(
                "invalid-options",
                f"no setting could be measured: {study.rows[0]['reason']}",
                "choose other settings, or have a look at the mesh's own run",
            )
        )
    front = [row for row in measured if row["standing"] == "front"]
    best = max(front or measured, key=lambda row: float(row["recall"]))
    return Summary(
        triangles=best["triangles"],
        input_triangles=input_triangles,
        levels=len(study.rows),
        seconds=seconds,
        precision=best["precision"],
        recall=best["recall"],
        overhang=best["overhang"],
        warnings=tuple(study.warnings),
    )
