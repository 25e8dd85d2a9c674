"""What a worker process loads before it says that it is ready, and does then: tasks by kind."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping

import simplifier
from service.engines.messages import Task
from service.engines.work.evaluation import evaluate_mesh
from service.engines.work.occluder import make_occluder
from service.engines.work.refusals import refusals
from service.engines.work.scene import make_scene
from service.engines.work.tradeoff import measure_tradeoff
from service.engines.work.visibility import find_sets
from service.engines.worker import (
    Cancel,
    DoTask,
    ReportProgress,
)
from service.jobs.job import JobKind, Summary

_WORKS: Mapping[JobKind, DoTask] = {
    JobKind.OCCLUDER: make_occluder,
    JobKind.EVALUATION: evaluate_mesh,
    JobKind.SCENE: make_scene,
    JobKind.TRADEOFF: measure_tradeoff,
    JobKind.VISIBILITY: find_sets,
}

_TETRAHEDRON = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
_SIDES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


def start() -> DoTask:
    """Compile or load every kernel and draw once, so that no job has to wait for that."""
    simplifier.warm_up()
    mesh = simplifier.TriangleMesh.from_soup(_TETRAHEDRON, _SIDES)
    least = simplifier.SimplifyOptions(resolution=16, preset="draft", moves=1, views=4, image=32)
    with tempfile.TemporaryDirectory() as folder:
        simplifier.simplify(mesh, least).measure().write_pictures(folder, "tetrahedron")
    return _work


def _work(task: Task, tell: ReportProgress, cancel: Cancel) -> Summary:
    with refusals(task):
        return _WORKS[task.kind](task, tell, cancel)
