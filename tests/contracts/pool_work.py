"""Work for pools, which their workers import from here."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

import numpy as np

from simplifier.errors import MeshError


def starter(arrived):
    """A job is a word and a value; settings name a folder for marks."""
    folder, process = Path(json.loads(arrived.settings)["folder"]), os.getpid()
    (folder / f"start-{process}-{time.monotonic_ns()}").touch()

    def work(data):
        kind, value = json.loads(data)
        return json.dumps(_answer(arrived.arrays, folder, kind, value)).encode()

    return work


def _answer(arrays, folder, kind, value):
    if kind == "sum":
        return float(arrays["numbers"][value:].sum())
    if kind == "shape":
        array = arrays[value]
        return [list(array.shape), str(array.dtype), bool(array.flags.c_contiguous)]
    if kind == "write":  # what is shared is of all jobs
        arrays["numbers"][0] = 1.0
    if kind == "threads":
        return os.environ["OCCLUDER_THREADS"]
    if kind == "mark":
        (folder / f"begun-{value}-{os.getpid()}").touch()
        return value
    if kind == "sleep":
        (folder / f"begun-{value}-{os.getpid()}").touch()
        time.sleep(value)
    if kind == "refuse":
        raise MeshError("it is no good", remedy="make it better")
    if kind == "fault":
        return [][value]
    if kind == "die" or (kind == "die once" and not (folder / "died").exists()):
        (folder / "died").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return kind


NUMBERS = [np.arange(5.0), np.arange(7.0), np.empty(0), np.arange(3.0)]
EMPTY = [np.empty((0, 3), dtype=np.int32)]
