"""Two S3 servers for tests, each a process of its own on a free port of this machine.

moto knows of more calls and keeps objects in memory; it takes wrong checksums.  localbucket keeps
them in files, so that they are there after a kill, and knows of few calls.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx

from tests.postgres import free_port
from tests.waiting import until

_START_SECONDS = 60.0

_http = httpx.Client(verify=False)
"""Without certificates, which take 30 ms to load, and a connection or two."""


@dataclass
class S3Server:
    """A server that runs; it can be killed, and started again at its address."""

    name: str
    command: tuple[str, ...]
    port: int = field(default_factory=free_port)
    buckets: int = 0
    _process: subprocess.Popen[bytes] | None = field(default=None, repr=False)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def variables(self) -> Mapping[str, str]:
        """For whoever asks it."""
        return {
            "AWS_ENDPOINT_URL": self.address,
            "AWS_ALLOW_HTTP": "true",
            "AWS_ACCESS_KEY_ID": "occluder",
            "AWS_SECRET_ACCESS_KEY": "secret",
            "AWS_REGION": "us-east-1",
        }

    def new_bucket(self) -> str:
        """An empty one; its name."""
        self.buckets += 1
        name = f"occluder-{self.buckets}"
        _http.put(f"{self.address}/{name}").raise_for_status()
        return name

    def start(self) -> None:
        command = [part.format(port=self.port) for part in self.command]
        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        until(self._listens, _START_SECONDS)

    def kill(self) -> None:
        assert self._process is not None
        self._process.kill()
        self._process.wait()

    def _listens(self) -> bool:
        try:
            return _http.get(self.address).status_code < 500
        except httpx.TransportError:
            return False


@contextmanager
def running_moto() -> Iterator[S3Server]:
    with _running("moto", "-m", "moto.server", "-H", "127.0.0.1", "-p", "{port}") as server:
        yield server


@contextmanager
def running_localbucket(folder: Path) -> Iterator[S3Server]:
    command = ("-m", "localbucket", "--host", "127.0.0.1", "--port", "{port}", str(folder))
    with _running("localbucket", *command) as server:
        yield server


@contextmanager
def _running(name: str, *command: str) -> Iterator[S3Server]:
    server = S3Server(name, (sys.executable, *command))
    server.start()
    try:
        yield server
    finally:
        server.kill()
