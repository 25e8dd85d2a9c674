"""A Ray cluster on this machine: a head and more raylets, each to be lost by itself.

Each node has one processor, and all of them listen on loopback alone and ask for a token.
"""

from __future__ import annotations

import os
import secrets
import shutil
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

from tests.acceptance.command import environment
from tests.cluster.machines import kill_tree, named_in
from tests.postgres import free_port
from tests.waiting import BUSY, until

_TOKEN = secrets.token_hex(32)  # of all, as a process reads its own but once
STORE = 200 << 20  # bytes of each node's object store
_HOST = "127.0.0.{}"  # of the nodes, from 2 on: Ray replaces 127.0.0.1 by one that others reach


class RayNode:
    """``ray start --block`` and all that it has started."""

    def __init__(self, arguments, variables, log):
        self.log = log
        self._variables = environment(**variables)
        with log.open("w") as told:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", *arguments],
                stdout=told, stderr=told, env=self._variables, start_new_session=True,
            )  # fmt: skip

    @property
    def is_ready(self):
        text = self.log.read_text()
        assert self._process.poll() is None, text
        return "--block" in text

    def named(self, name):
        """Process ids of those whose command begins so; Ray gives a worker its task's name."""
        return named_in(self._process.pid, name)

    def kill(self):
        """All of it at once, as the loss of the machine does."""
        kill_tree(self._process.pid)
        self._process.wait()


class RayCluster:
    """``nodes``, the head first; ``variables`` are what a driver needs to join it."""

    def __init__(self, folder, nodes, store=STORE, **variables):
        self._folder, self._store = folder, store
        self.address = f"{_HOST.format(2)}:{free_port()}"
        self.variables = {
            "RAY_ADDRESS": self.address, "RAY_AUTH_MODE": "token",
            "RAY_AUTH_TOKEN": _TOKEN, "RAY_USAGE_STATS_ENABLED": "0",
        }  # fmt: skip
        port = self.address.rpartition(":")[2]
        self.nodes = []
        try:
            self._start(
                "--head", f"--port={port}", "--include-dashboard=false", f"--temp-dir={folder}",
            )  # fmt: skip
            until(lambda: self.nodes[0].is_ready, BUSY)
            for _ in range(nodes - 1):
                self.add(**variables)
        except BaseException:
            self.close()
            raise

    def add(self, **variables):
        """One more node, with environment variables of its own."""
        self._start(f"--address={self.address}", **variables)
        node = self.nodes[-1]
        until(lambda: node.is_ready, BUSY)
        return node

    def _start(self, *arguments, **variables):
        log = self._folder / f"node-{len(self.nodes)}.log"
        common = (
            f"--node-ip-address={_HOST.format(2 + len(self.nodes))}", "--num-cpus=1",
            f"--object-store-memory={self._store}", "--disable-usage-stats",
        )  # fmt: skip
        self.nodes.append(RayNode([*arguments, *common], self.variables | variables, log))

    @contextmanager
    def pool(self):
        """That of ``--pool ray``, in this process."""
        from service.ray_cluster.pool import ray_pool

        with mock.patch.dict(os.environ, self.variables), ray_pool() as opened:
            yield opened

    def close(self):
        for node in reversed(self.nodes):
            node.kill()


@contextmanager
def ray_cluster(nodes=2, **more):
    """A running one, which ends with the block."""
    # Short: sockets lie in it, and their paths may have a hundred characters.
    folder = Path(tempfile.mkdtemp(prefix="ray-", dir="/tmp"))
    try:
        cluster = RayCluster(folder, nodes, **more)
        try:
            yield cluster
        finally:
            cluster.close()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
