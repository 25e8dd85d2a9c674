"""A real server in a folder of its own, and what its processes use of memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

_GRACE = 30.0  # seconds


@dataclass(frozen=True)
class Served:
    """A running server."""

    address: str
    folder: Path
    process: subprocess.Popen[str]

    @property
    def port(self) -> int:
        return int(self.address.rpartition(":")[2])

    @property
    def resident_mib(self) -> float:
        """Of the server's own process, without its workers."""
        return self._status("VmRSS")

    @property
    def peak_mib(self) -> float:
        return self._status("VmHWM")

    @property
    def processor_seconds(self) -> float:
        """That it and its workers have taken."""
        return sum(map(_processor_seconds, _tree(self.process.pid)))

    def _status(self, name: str) -> float:
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(name)) / 1024.0


@contextmanager
def served(**settings: object) -> Iterator[Served]:
    """Start ``occluder serve`` on a free port of loopback; end it with the block.

    ``settings`` are variables by their name without ``OCCLUDER_``, in small letters.
    """
    with tempfile.TemporaryDirectory(prefix="service_load") as place:
        folder = Path(place)
        variables = {f"OCCLUDER_{name.upper()}": str(value) for name, value in settings.items()}
        with (folder / "log").open("w") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "simplifier", "serve", "--port", "0", "--data", "data"],
                cwd=folder, env={**_paths(), **variables}, text=True,
                stdout=subprocess.PIPE, stderr=log,
            )  # fmt: skip
        try:
            assert process.stdout is not None
            line = process.stdout.readline()  # told once it listens
            if not line:
                raise RuntimeError(f"the server did not start: {(folder / 'log').read_text()}")
            yield Served(line.split()[-1], folder, process)
        finally:
            process.terminate()
            try:
                process.wait(_GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _tree(pid: int) -> Iterator[int]:
    """A process and those that its threads, and theirs, have started."""
    yield pid
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            yield from _tree(int(child))


def _processor_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _paths() -> dict[str, str]:
    """This process's environment; what it imports from, its server does too."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
