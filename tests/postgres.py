"""A PostgreSQL server of the tests' own, on loopback and a free port, that ends with them."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any

import psycopg
import pytest

ABSENT = "PostgreSQL is not installed: apt-get install postgresql"

_USER = "occluder"


def program(name: str) -> Path | None:
    """Where a program of the server is; None where there is no server."""
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    found = [folder / name for folder in folders if (folder / name).exists()]
    on_path = shutil.which(name)
    return found[0] if found else Path(on_path) if on_path else None


class PostgresServer:
    """Runs until it is stopped; nothing is made to last, unless ``durable``."""

    def __init__(self, *, durable: bool = False) -> None:
        """Skips the test where there is no server to start."""
        if program("initdb") is None:
            pytest.skip(ABSENT)
        self._names = count()
        self._template: str | None = None
        # The server refuses to be root's, and its folder must not lie where it may not look.
        self._folder = Path(tempfile.mkdtemp(prefix="occluder-postgres-", dir="/tmp"))
        self._user = None if os.getuid() else pwd.getpwnam("postgres")
        if self._user is not None:
            os.chown(self._folder, self._user.pw_uid, self._user.pw_gid)
        self.port = free_port()
        self._durable = durable
        self._run(
            "initdb", "-D", self._data, "-U", _USER, "--auth=trust", "--no-sync",
            "--encoding=UTF8", "--locale=C",
        )  # fmt: skip
        self.start()

    @property
    def _data(self) -> str:
        return str(self._folder / "data")

    def start(self) -> None:
        lasting = [] if self._durable else ["-c fsync=off", "-c full_page_writes=off"]
        options = [
            f"-p {self.port}", "-c listen_addresses=127.0.0.1",
            f"-c unix_socket_directories={self._folder}", "-c max_connections=200",
            "-c shared_buffers=32MB", "-c max_wal_size=256MB", *lasting,
        ]  # fmt: skip
        self._run(
            "pg_ctl", "-D", self._data, "-w", "-s", "-l", str(self._folder / "log"),
            "-o", " ".join(options), "start",
        )  # fmt: skip

    def kill(self) -> None:
        """As the loss of power does, but for the disk."""
        pid = int((Path(self._data) / "postmaster.pid").read_text().splitlines()[0])
        self._run("pg_ctl", "-D", self._data, "-s", "-w", "-m", "immediate", "stop")
        with suppress(ProcessLookupError):
            os.kill(pid, 9)

    def stop(self) -> None:
        """End it, and remove what it has written."""
        with suppress(subprocess.CalledProcessError):
            self._run("pg_ctl", "-D", self._data, "-s", "-w", "-m", "immediate", "stop")
        shutil.rmtree(self._folder, ignore_errors=True)

    def address(self, name: str = "postgres") -> str:
        return f"postgresql://{_USER}@127.0.0.1:{self.port}/{name}"

    def execute(self, statement: str, name: str = "postgres") -> list[Any]:
        """In a transaction of its own; rows, where there are any."""
        with psycopg.connect(self.address(name), autocommit=True) as connection:
            cursor = connection.execute(statement)
            return cursor.fetchall() if cursor.description else []

    def empty_database(self, options: str = "") -> str:
        """The address of a new one, without tables."""
        name = f"test_{next(self._names)}"
        self.execute(f"CREATE DATABASE {name} {options}")
        return self.address(name)

    def database(self) -> str:
        """The address of a new one, with the tables of this release."""
        from service.storage.postgres import migrate_server

        if self._template is None:
            address = self.empty_database()
            migrate_server(address)
            self._template = address.rpartition("/")[2]
        return self.empty_database(f"TEMPLATE {self._template}")

    def drop(self, address: str) -> None:
        self.execute(f"DROP DATABASE IF EXISTS {address.rpartition('/')[2]} WITH (FORCE)")

    def _run(self, name: str, *words: str) -> None:
        path = program(name)
        assert path is not None
        user = {} if self._user is None else {"user": self._user.pw_uid, "group": self._user.pw_gid}
        subprocess.run(
            [path, *words], check=True, cwd=self._folder, stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE, extra_groups=[] if user else None, **user,
        )  # fmt: skip


@contextmanager
def running_postgres(*, durable: bool = False) -> Iterator[PostgresServer]:
    server = PostgresServer(durable=durable)
    try:
        yield server
    finally:
        server.stop()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
