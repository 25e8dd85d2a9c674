"""What a worker process loads before it says that it is ready, and what it does then: a task by its
kind, with what the library refuses put into words for the job's owner.
"""

from __future__ import annotations

import errno
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import simplifier
from service.engines.failures import disk_full, too_much_memory
from service.engines.messages import Task
from service.engines.work.evaluation import evaluate_mesh
from service.engines.work.inputs import task_memory, without_paths
from service.engines.work.occluder import make_occluder
from service.engines.work.scene import make_scene
from service.engines.work.tradeoff import measure_tradeoff
from service.engines.worker import (
    Cancel,
    DoTask,
    ReportProgress,
    TaskCancelledError,
    TaskFailedError,
)
from service.jobs.job import Failure, JobKind, Summary

_WORKS: Mapping[JobKind, DoTask] = {
    JobKind.OCCLUDER: make_occluder,
    JobKind.EVALUATION: evaluate_mesh,
    JobKind.SCENE: make_scene,
    JobKind.TRADEOFF: measure_tradeoff,
}

_TETRAHEDRON = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
_SIDES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_KINDS = {
    simplifier.MeshError: "unreadable-mesh",
    simplifier.OptionError: "invalid-options",
    simplifier.OverridesError: "invalid-overrides",
    simplifier.BackendUnavailableError: "unavailable",
}


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


@contextmanager
def refusals(task: Task) -> Iterator[None]:
    """Raise what a task may raise; faults of the program pass through."""
    try:
        yield
    except simplifier.CancelledError as error:
        raise TaskCancelledError from error
    except simplifier.MemoryLimitError as error:
        limit = task_memory(task)
        raise TaskFailedError(too_much_memory(error.what, error.resolution, limit)) from error
    except tuple(_KINDS) as error:
        kind = next(kind for of, kind in _KINDS.items() if isinstance(error, of))
        raise TaskFailedError(_failure(kind, error, task)) from error
    except (simplifier.OutputError, OSError) as error:
        if _lacks_room(error):
            raise TaskFailedError(disk_full("the work")) from error
        raise
    except RuntimeError as error:
        # What a thread's stack has no room for; nothing else that is raised is so.
        if "can't start new thread" in str(error):
            raise MemoryError from error
        raise


def _failure(kind: str, error: simplifier.OccluderError, task: Task) -> Failure:
    where = without_paths(error.where, task)
    what = without_paths(error.what, task)
    return Failure(kind, f"{where}: {what}" if where else what, error.remedy)


def _lacks_room(error: BaseException | None) -> bool:
    """Whether the disk was full; the library's own error came while it heard of that."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _NO_ROOM:
            return True
        error = error.__context__
    return False
