"""A mesh to occluders by level, judged and drawn; pictures of the best one so far on the way."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import simplifier
from service.engines.messages import Task
from service.engines.work.inputs import input_path, options_within_memory, read_mesh
from service.engines.work.levels_file import save_levels
from service.engines.work.meter import MAKING, Meter
from service.engines.work.report_files import (
    PICTURE_SIZE,
    command_names,
    summary_of,
    write_report,
    write_thumbnail,
)
from service.engines.worker import Cancel, ReportProgress, TaskCancelledError
from service.jobs.job import Summary
from service.jobs.on_demand import LEVELS, ORIGINAL, WHOLE, level_file
from service.jobs.progress import Snapshot
from service.keep import Keep

_PICTURE_PAUSE = 1.0  # seconds before the first and between two
_DRAWING_SHARE = 0.05  # of the time that drawing may take


def make_occluder(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    """Results: ``occluder.glb`` with all levels, ``lod0.glb``, ``lod0.obj``... of each, a report,
    ``original.glb`` to look at beside them, and a thumbnail; where little is kept, the first, the
    report, and what the others are written from.

    Raises as :data:`~service.engines.worker.DoTask` says, and :class:`simplifier.OccluderError`.
    """
    meter, results = Meter(tell), Path(task.results)
    options = simplifier.SimplifyOptions.of(options_within_memory(task))
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
    scratch = Path(task.scratch)
    if task.keep is Keep.LEAN:
        files = _save_whole(made, scratch, results)
    else:
        files = _save_all(made, scratch, results)
        simplifier.save_for_viewing(mesh, results / ORIGINAL)
        write_thumbnail(draw.view, made.occluder, task)
    write_seconds = time.perf_counter() - begin
    meter.at("accuracy", 0.82)
    product = made.measure()
    meter.at("write", 0.9)
    report = product.report(
        load_seconds=load_seconds, write_seconds=write_seconds, files=files,
        names=command_names(task.name),
    )  # fmt: skip
    write_report(product, report, task)
    return summary_of(report, len(product.levels), meter.seconds)


def _save_all(made: simplifier.SimplifyResult, scratch: Path, results: Path) -> tuple[Path, ...]:
    """Save each level in each format, a GLB and an OCC with all; the single GLBs, finest first."""
    for suffix in simplifier.OCCLUDER_SUFFIXES:
        for level, path in enumerate(made.save(scratch / f"occluder{suffix}")):
            shutil.copyfile(path, results / level_file(level, suffix))
    for name in WHOLE:
        (scratch / name).replace(results / name)
    return _level_files(made, results)


def _save_whole(made: simplifier.SimplifyResult, scratch: Path, results: Path) -> tuple[Path, ...]:
    """Save a GLB with all levels, and what is needed to write any file later; the single GLBs."""
    made.save(scratch / WHOLE[0])
    (scratch / WHOLE[0]).replace(results / WHOLE[0])
    save_levels(made, results / LEVELS)
    return _level_files(made, results)


def _level_files(made: simplifier.SimplifyResult, results: Path) -> tuple[Path, ...]:
    count = 1 if made.chain is None else len(made.chain.levels)
    return tuple(results / level_file(level, ".glb") for level in range(count))


class BestSoFar:
    """Draws once a second at most, from above; rather later than at a loss of time.

    The first one draws the mesh too, which takes longest; a job that is done within a second draws
    nothing.
    """

    def __init__(
        self,
        mesh: simplifier.TriangleMesh,
        up: Literal["x", "y", "z"],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._mesh, self._up, self._clock = mesh, up, clock
        self._view: simplifier.Viewpoint | None = None  # once it is asked for
        self._number = 0
        self._due = clock() + _PICTURE_PAUSE

    @property
    def view(self) -> simplifier.Viewpoint:
        """From where pictures are drawn."""
        if self._view is None:
            self._view = simplifier.Viewpoint(self._mesh, size=PICTURE_SIZE, up=self._up)
        return self._view

    def __call__(self, progress: simplifier.Progress) -> Snapshot | None:
        """A picture, where one is due."""
        begin = self._clock()
        if progress.best is None or begin < self._due:
            return None
        png = self.view.picture(progress.best())
        end = self._clock()
        self._due = end + max(_PICTURE_PAUSE, (end - begin) / _DRAWING_SHARE)
        self._number += 1
        return Snapshot(self._number, png)
