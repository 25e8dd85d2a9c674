"""The report of an occluder as files and as the numbers that lists and histories show.

Its pages are drawn with it, or by a process of their own when somebody asks for them.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, Protocol

import simplifier
from service.engines.messages import Task
from service.engines.work.inputs import input_path, options_within_memory, read_mesh
from service.engines.work.refusals import refusals
from service.engines.worker import Cancel, DoTask, ReportProgress
from service.jobs.job import JobKind, Summary
from service.jobs.pages import FINEST, REPORT


class Judged(Protocol):
    """What can be drawn: a product or a judgement."""

    def write_pictures(
        self, folder: str | Path, name: str, report: dict[str, Any] | None = None
    ) -> list[Path]: ...


def write_report(judged: Judged, report: dict[str, Any], task: Task) -> None:
    """Write ``report.json``, and where the task says so ``report.html`` and ``pictures/``.

    Raises OSError and :class:`simplifier.OutputError`.
    """
    results = Path(task.results)
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    (results / REPORT).write_text(text, "utf-8")
    if task.pages:
        judged.write_pictures(results / _PICTURES, task.name, report)
        _part(results)


def _part(results: Path) -> None:
    """The page holds its pictures itself, and lies beside their folder."""
    (results / _PICTURES / "report.html").replace(results / "report.html")


def start_drawing() -> DoTask:
    """What a process does that draws pages: nothing is got ready, as most draw a few and end."""
    return draw_pages


def draw_pages(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: ``report.html`` and ``pictures/`` of what a job has made and told in its report.

    Raises as :data:`~service.engines.worker.DoTask` says.  The summary has the time alone.
    """
    begin = time.perf_counter()
    results = Path(task.results)
    with refusals(task):
        options = _OPTIONS[task.kind].of(options_within_memory(task))
        mesh, _ = read_mesh(task, options)
        finest = input_path(task, PurePosixPath(FINEST).stem)
        occluder = simplifier.load_occluder(
            finest, allow_external=False, memory_limit=options.memory_limit
        )
        report = json.loads(input_path(task, PurePosixPath(REPORT).stem).read_text("utf-8"))
        simplifier.draw_report(results / _PICTURES, mesh, occluder, report, name=task.name)
        _part(results)
    return Summary(0, 0, 0, time.perf_counter() - begin)


_PICTURES = "pictures"
_OPTIONS: Mapping[JobKind, type[simplifier.SimplifyOptions] | type[simplifier.EvaluateOptions]] = {
    JobKind.OCCLUDER: simplifier.SimplifyOptions,
    JobKind.EVALUATION: simplifier.EvaluateOptions,
}


def command_names(name: str) -> tuple[str, str]:
    """Of mesh and occluder in a command to try: the mesh as its owner calls it."""
    return name, f"{PurePosixPath(name).stem}_occluder.glb"


def summary_of(report: Mapping[str, Any], levels: int, seconds: float) -> Summary:
    """The numbers of the finest level; ``report`` as ``docs/report.schema.json`` says."""
    worst, verdict = report["worst_view"], report["verdict"]
    return Summary(
        triangles=report["triangles"],
        input_triangles=report["input"]["triangles"],
        levels=levels,
        seconds=seconds,
        precision=report["precision"],
        recall=report["recall"],
        worst_recall=worst["recall"],
        worst_view=worst["index"],
        overhang=report["overhang"]["share"],
        verdict=verdict["word"],
        reason=verdict["reason"],
        try_next=verdict["next"],
        error_bound=report["error_bound"],
        timings=dict(report["timings"]),
        warnings=tuple(report["warnings"]),
    )
