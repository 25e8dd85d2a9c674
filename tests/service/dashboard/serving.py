"""Applications in processes of their own: NiceGUI keeps one for each process."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tests.faults.serving import LIGHT_WORK, SURROUNDINGS

_ROOT = Path(__file__).parents[3]
_PATIENCE = 10.0  # seconds, for a server to end

IDLE = {
    "PYTHONPATH": os.pathsep.join(map(str, [SURROUNDINGS, _ROOT])),
    "FAULTS_WORK": str(LIGHT_WORK),
}
"""In the environment of a server whose jobs are of no account: to load the library, that no job
needs, would take its worker 4 s of processor time."""


@contextmanager
def served(app: str, environment: Mapping[str, str] | None = None) -> Iterator[str]:
    """The address of a server of ``module:app``, or ``module:make_app()``, on a free port.

    It listens before the process has begun, so that the first request waits until it is ready.
    """
    name, called, _ = app.partition("()")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"http://127.0.0.1:{listener.getsockname()[1]}"
        command = [sys.executable, "-m", "uvicorn", name, "--fd", str(listener.fileno())]
        process = subprocess.Popen(
            [*command, "--log-level", "warning", *(["--factory"] if called else [])],
            pass_fds=[listener.fileno()],
            cwd=_ROOT,
            env=_inherited() | dict(environment or {}),
        )
    try:
        yield address
    finally:
        process.terminate()
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _inherited() -> dict[str, str]:
    """Without what would change the behaviour of a server, or of NiceGUI under test."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("OCCLUDER_", "PYTEST_"))
    }
    return kept | {"PYTHONPATH": str(_ROOT)}
