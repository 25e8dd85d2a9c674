"""Files of a result that are made when somebody asks for them, from what its job has kept."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import simplifier
from service.engines.messages import Task
from service.engines.work.inputs import input_path, options_within_memory, read_mesh
from service.engines.work.levels_file import load_levels
from service.engines.work.refusals import refusals
from service.engines.work.report_files import PICTURES, part_page
from service.engines.work.scene import record_walk
from service.engines.worker import Cancel, DoTask, ReportProgress
from service.jobs.job import JobKind, Summary
from service.jobs.on_demand import (
    EXACT,
    LEVELS,
    LOSS,
    ORIGINAL,
    REPORT,
    WALK,
    is_page,
    level_of,
)

_OPTIONS: Mapping[JobKind, type[simplifier.SimplifyOptions] | type[simplifier.EvaluateOptions]] = {
    JobKind.OCCLUDER: simplifier.SimplifyOptions,
    JobKind.EVALUATION: simplifier.EvaluateOptions,
}


def start() -> DoTask:
    """Nothing is got ready, as most processes make a few files and end."""
    return make_file


def make_file(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: the wanted file, the same bytes as with the job; for a page all of the report's.

    Raises as :data:`~service.engines.worker.DoTask` says.  The summary has the time alone.
    """
    begin = time.perf_counter()
    results, name = Path(task.results), task.wanted or ""
    with refusals(task):
        if is_page(name):
            _draw(task, results)
        elif name == WALK:
            (results / name).write_bytes(record_walk(task, cancel))
        elif name == ORIGINAL:
            simplifier.save_for_viewing(_mesh(task), results / name)
        elif name == LOSS:
            simplifier.save_loss_map(results / name, _mesh(task), _finest(task), _report(task))
        else:
            _write_levels(task, name, results / name)
    return Summary(0, 0, 0, time.perf_counter() - begin)


def _draw(task: Task, results: Path) -> None:
    simplifier.draw_report(
        results / PICTURES, _mesh(task), _finest(task), _report(task), name=task.name
    )
    part_page(results)


def _write_levels(task: Task, name: str, target: Path) -> None:
    """One level, or all of them."""
    made, one = _made(task), level_of(name)
    if one is not None and isinstance(made, simplifier.LodChain):
        made = made.levels[one[0]].occluder
    if isinstance(made, simplifier.LodChain):
        # Beside it come its levels, which nobody has asked for.
        draft = Path(task.scratch) / name
        simplifier.save(made, draft)
        draft.replace(target)
    else:
        simplifier.save(made, target)


def _mesh(task: Task) -> simplifier.TriangleMesh:
    return read_mesh(task, _OPTIONS[task.kind].of(options_within_memory(task)))[0]


def _finest(task: Task) -> simplifier.Occluder:
    made = _made(task)
    return made.levels[0].occluder if isinstance(made, simplifier.LodChain) else made


def _report(task: Task) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(input_path(task, REPORT).read_text("utf-8"))
    return report


def _made(task: Task) -> simplifier.LodChain | simplifier.Occluder:
    """What the job has made, or was sent to judge."""
    if LEVELS in task.inputs:
        return load_levels(input_path(task, LEVELS))
    name = EXACT if EXACT in task.inputs else "occluder"
    options = _OPTIONS[task.kind].of(options_within_memory(task))
    return simplifier.load_occluder(
        input_path(task, name), allow_external=False, memory_limit=options.memory_limit
    )
