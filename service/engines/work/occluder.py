"""A mesh to occluders by level, judged and drawn."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import simplifier
from service.engines.messages import Task
from service.engines.work.allowance import allowed_options
from service.engines.work.best_so_far import BestSoFar
from service.engines.work.input_mesh import read_mesh
from service.engines.work.meter import MAKING, Meter
from service.engines.work.numbers import summary_of
from service.engines.work.pages import write_pages
from service.engines.work.refusals import input_path
from service.engines.worker import Cancel, TaskCancelledError, Tell
from service.jobs.job import Summary


def make_occluder(task: Task, tell: Tell, cancel: Cancel) -> Summary:
    """Results: ``occluder.glb`` with all levels, ``lod0.glb``, ``lod0.obj``... of each, a report,
    and ``original.glb`` to look at beside them.

    Raises as :data:`~service.engines.worker.Work` says, and :class:`simplifier.OccluderError`.
    """
    meter, results = Meter(tell), Path(task.results)
    options = simplifier.SimplifyOptions.of(allowed_options(task))
    meter.at("load", 0.0)
    simplifier.check_file(input_path(task, "mesh"), options, pictures=True, viewing=True)
    mesh, overrides = read_mesh(task, options)
    load_seconds = meter.seconds
    draw = BestSoFar(mesh, options.up)
    made = simplifier.simplify(
        mesh, options, listener=meter.part(0.05, 0.8, MAKING, draw), cancel=cancel,
        overrides=overrides,
    )  # fmt: skip
    if cancel.is_set():  # by then it is the best so far
        raise TaskCancelledError
    meter.at("write", 0.8)
    begin = time.perf_counter()
    files = _save(made, Path(task.scratch), results)
    simplifier.save_for_viewing(mesh, results / "original.glb")
    write_seconds = time.perf_counter() - begin
    meter.at("accuracy", 0.82)
    product = made.measure()
    meter.at("write", 0.9)
    report = product.report(load_seconds=load_seconds, write_seconds=write_seconds, files=files)
    write_pages(product, report, task.name, results)
    return summary_of(report, len(product.levels), meter.seconds)


def _save(made: simplifier.SimplifyResult, scratch: Path, results: Path) -> tuple[Path, ...]:
    """Every level in every format, a GLB and an OCC with all; the own GLBs, finest first."""
    for suffix in simplifier.OCCLUDER_SUFFIXES:
        for level, path in enumerate(made.save(scratch / f"occluder{suffix}")):
            shutil.copyfile(path, results / f"lod{level}{suffix}")
    for name in ("occluder.glb", "occluder.occ"):
        (scratch / name).replace(results / name)
    return tuple(sorted(results.glob("lod*.glb"), key=lambda path: int(path.stem[3:])))
