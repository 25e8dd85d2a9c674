"""Work for other processes, which import it from here."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from simplifier.errors import MeshError
from simplifier.kernels.threads import thread_count


def starter(folder=""):
    """``start`` of :func:`simplifier.processes.run_jobs`."""
    return lambda job: work(Path(folder), *job)


def dying(*arguments):
    os.kill(os.getpid(), signal.SIGKILL)


def work(folder, kind, value):
    if kind == "square":
        return value * value
    if kind == "mark":  # says that it was done, and how often
        (folder / f"{value}-{time.monotonic_ns()}").touch()
        return os.getpid()
    if kind == "threads":
        return thread_count()
    if kind == "variable":
        return os.environ.get(value)
    if kind == "sleep":
        time.sleep(value)
    if kind == "refuse":
        raise MeshError("it is no good", remedy="make it better")
    if kind == "memory":
        raise MemoryError
    if kind == "fault":
        return [][value]
    if kind == "unsendable":
        return lambda: None
    if kind == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "die once":
        marker = folder / "died"
        if not marker.exists():
            marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
    return kind
