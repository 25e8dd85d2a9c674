"""A command as a whole: time and the peak memory, of it and all processes that it starts."""

from __future__ import annotations

import os
import resource
import subprocess
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from bench.machine import ROOT

_GLANCE = 0.05  # seconds at least between two looks at the memory
_SHARE = 0.02  # of the time at most for these, which hold up the processes that are looked at


@dataclass(frozen=True)
class Run:
    """``peak_mib``: the largest sum of proportional set sizes (shared pages count once).

    ``cpu_seconds`` are those of all processes that were waited for, in user and system.
    """

    seconds: float
    cpu_seconds: float
    peak_mib: float
    output: str


def run_command(command: Sequence[str], variables: Mapping[str, str] | None = None) -> Run:
    """Run a command from the project's root and watch it; raises CalledProcessError.

    ``variables`` are set in its environment.
    """
    begin, before = time.perf_counter(), _children_seconds()
    with (
        ThreadPoolExecutor(1) as watcher,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT,
            env=_environment(variables or {}),
        ) as process,
    ):  # fmt: skip
        ended = Event()
        peak = watcher.submit(_peak_kib, process.pid, ended)
        try:
            output, _ = process.communicate()  # which ends as soon as the command does
            seconds = time.perf_counter() - begin
        finally:
            ended.set()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command, output)
    return Run(seconds, _children_seconds() - before, peak.result() / 1024.0, output)


def _peak_kib(root: int, ended: Event) -> int:
    """The most memory that a process and all below it were seen to have until they ended."""
    peak, pause = 0, 0.0
    while not ended.wait(pause):
        begin = time.perf_counter()
        peak = max(peak, sum(_kib(pid) for pid in _tree(root)))
        pause = max(_GLANCE, (time.perf_counter() - begin) / _SHARE)
    return peak


def _environment(variables: Mapping[str, str]) -> dict[str, str]:
    """This process's, but for what a machine may be set to: Python keeps what it has compiled."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, **variables}


def _children_seconds() -> float:
    """CPU time of all processes that this one has started and waited for, and of theirs."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _tree(root: int) -> list[int]:
    """A process and all below it, as far as they are still there."""
    found, waiting = [], [root]
    while waiting:
        pid = waiting.pop()
        found.append(pid)
        for task in Path(f"/proc/{pid}/task").glob("*/children"):
            try:
                waiting += [int(child) for child in task.read_text().split()]
            except OSError:  # it has just ended
                continue
    return found


def _kib(pid: int) -> int:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
