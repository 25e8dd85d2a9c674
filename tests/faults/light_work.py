"""Work that takes next to no time, or what the first line of its mesh says.

``# occupy SECONDS``, ``# wait FILE`` until the file is there, ``# fill BYTES``, ``# die``.
"""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

from service.engines.work.inputs import input_path
from service.engines.work.refusals import refusals
from service.engines.worker import TaskCancelledError
from service.jobs.job import Summary
from service.jobs.progress import JobProgress

RESULTS = {"lod0.obj", "report.json"}
REPORT = {"triangles": 1, "precision": 1.0, "recall": 0.5, "error_bound": 0.1}


def start():
    return work


def work(task, tell, cancel):
    with refusals(task):
        mesh = input_path(task, "mesh").read_bytes()
        tell(JobProgress("voxelize", 0.5))
        _obey(mesh.partition(b"\n")[0].decode().split(), Path(task.results), cancel)
        (Path(task.results) / "lod0.obj").write_bytes(mesh)
        (Path(task.results) / "report.json").write_text(json.dumps(REPORT))
    return Summary(1, 12, 1, 0.1, precision=1.0, recall=0.5)


def _obey(words, results, cancel):
    match words:
        case ["#", "occupy", seconds]:
            end = time.monotonic() + float(seconds)
            _wait_for(lambda: time.monotonic() >= end, cancel)
        case ["#", "wait", file]:
            _wait_for(Path(file).exists, cancel)
        case ["#", "fill", size]:
            (results / "picture.png").write_bytes(os.urandom(int(size)))
        case ["#", "die"]:
            os.kill(os.getpid(), signal.SIGSEGV)


def _wait_for(condition, cancel):
    while not condition():
        if cancel.wait(0.01):
            raise TaskCancelledError
