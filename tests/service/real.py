"""A real server, started as users start it, on a free port of loopback."""

from __future__ import annotations

import signal
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.acceptance.command import OCCLUDER, environment

BOX = b"""v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""

QUICK = {"resolution": 8, "moves": 0, "views": 4, "image": 32, "quads": 64, "lods": 1}
"""Options of a job that takes next to no time."""


@dataclass(frozen=True)
class RunningServer:
    """A server that listens; its log grows."""

    address: str
    process: subprocess.Popen
    log: Path

    def end(self, number=signal.SIGTERM):
        """Send a signal and wait; the exit status."""
        self.process.send_signal(number)
        try:
            return self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGABRT)  # which tells where its threads are
            self.process.wait(30)
            raise AssertionError(f"it does not end: {self.log.read_text()[-20_000:]}") from None

    @property
    def workers(self):
        """Process ids of its workers."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(pid) for task in tasks for pid in task.read_text().split()]


@contextmanager
def running(declared, data, *arguments, **variables):
    """Serve until the block ends; ``declared`` is the path to the service's commands."""
    log = data.with_suffix(".log")
    command = [*OCCLUDER, "serve", "--port", "0", "--data", data, *arguments]
    with log.open("a") as file:
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=file, text=True,
            env=environment(
                PYTHONPATH=declared, PYTHONFAULTHANDLER="1",
                **{"OCCLUDER_WORKERS": "1", **variables},
            ),
        )  # fmt: skip
    with process:
        try:
            line = process.stdout.readline()
            assert line.startswith("occluder serves at http://"), log.read_text()
            yield RunningServer(line.split()[-1], process, log)
        finally:
            process.kill()
