"""A Ray cluster on this machine, with a token, and the dispatcher to it; each can be killed."""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.acceptance.command import OCCLUDER, environment
from tests.cluster.machines import children_of, kill_tree, named_in, tree_of
from tests.postgres import free_port
from tests.waiting import BUSY, until

_START = Path(__file__).with_name("ray_start.py")
_MEMORY, _STORE = 6 << 30, 80 << 20


class RayNodes:
    """A head and ``more`` nodes, of one processor each; all are started.

    ``variables``  of the nodes: what ``occluder work`` would be given.
    """

    def __init__(self, declared, variables, more=1, processors=1):
        # Ray's sockets lie in its folder, and their paths must not be long.
        self.folder = Path(tempfile.mkdtemp(prefix="ray-", dir="/tmp"))
        token = self.folder / "token"
        token.write_text(secrets.token_hex(24))
        token.chmod(0o600)
        self.address = f"127.0.0.1:{free_port()}"
        # Drivers look for a node of their own address; this one is it.
        self.joining = {
            "RAY_ADDRESS": self.address, "RAY_AUTH_MODE": "token",
            "RAY_AUTH_TOKEN_PATH": str(token), "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
        }  # fmt: skip
        self.nodes = []
        try:
            for number in range(1 + more):
                node = Node(
                    self.folder / f"n{number}", processors, self.address, head=number == 0,
                    variables=environment(
                        PYTHONPATH=declared, **variables | {
                            "OCCLUDER_DATA": str(self.folder / f"data-{number}"),
                            "RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN_PATH": str(token),
                        },
                    ),
                )  # fmt: skip
                self.nodes.append(node)
                node.start()
        except BaseException:
            self.close()
            raise

    @property
    def head(self):
        return self.nodes[0]

    def close(self):
        for node in reversed(self.nodes):
            node.kill()
        shutil.rmtree(self.folder, ignore_errors=True)


class Node:
    """``ray start --block`` and all that it has started; it ends where its raylet does."""

    def __init__(self, folder, processors, address, *, head, variables):
        port = address.rpartition(":")[2]
        self._arguments = [
            *(
                ["--head", f"--port={port}", "--include-dashboard=false"] if head
                else [f"--address={address}"]
            ),
            "--block", "--node-ip-address=127.0.0.1", f"--num-cpus={processors}",
            f"--memory={_MEMORY}", f"--object-store-memory={_STORE}",
            "--disable-usage-stats", "--include-log-monitor=false", "--num-gpus=0",
            "--dashboard-agent-listen-port=0", f"--temp-dir={folder}",
        ]  # fmt: skip
        self._log = folder.with_suffix(".log")
        self._variables = variables
        self.data = Path(variables["OCCLUDER_DATA"])
        self._process = None

    @property
    def log(self):
        return self._log.read_text()

    def start(self, **variables):
        began = self._log.stat().st_size if self._log.exists() else 0
        with self._log.open("a") as log:
            self._process = subprocess.Popen(
                [sys.executable, _START, "start", *self._arguments], stdout=log, stderr=log,
                stdin=subprocess.DEVNULL, env=self._variables | variables,
            )  # fmt: skip

        def is_up():
            assert self._process.poll() is None, self.log
            return "Ray runtime started" in self.log[began:]

        until(is_up, BUSY)

    def kill(self):
        """All of it at once, as the loss of the machine does."""
        if self._process is None:
            return
        kill_tree(self._process.pid)
        self._process.wait()
        self._process = None

    def kill_raylet(self):
        """It alone; whatever started it ends when it hears of that."""
        (raylet,) = self.named("raylet")
        others = tree_of(self._process.pid)
        os.kill(raylet, signal.SIGKILL)
        self._process.wait(BUSY)
        self._process = None
        return [pid for pid in others if pid != raylet]

    def wait_for_its_end(self):
        """As comes by itself where the head is gone, or is another."""
        self._process.wait(2 * BUSY)
        self._process = None

    def tasks(self):
        """Process ids of Ray's workers that have a confined process, which does jobs."""
        return [pid for pid in self.named("ray::") if children_of(pid)]

    def named(self, name):
        """Those of its processes whose command begins so."""
        return named_in(self._process.pid, name)


class Dispatch:
    """``occluder dispatch`` and the driver that it keeps running."""

    def __init__(self, declared, log, variables):
        self._log = log
        self._environment = environment(PYTHONPATH=declared, **variables)
        self._process = None

    @property
    def log(self):
        """What all of its lives have written."""
        return self._log.read_text()

    def start(self):
        with self._log.open("a") as log:
            self._process = subprocess.Popen(
                [*OCCLUDER, "dispatch"], stdout=subprocess.PIPE, stderr=log, text=True,
                env=self._environment,
            )  # fmt: skip
        line = self._process.stdout.readline()
        assert line.startswith("occluder dispatches"), self.log
        return self

    def kill(self):
        """It alone: its driver has to end by itself."""
        if self._process is None:
            return
        drivers = children_of(self._process.pid)
        self._process.kill()
        self._close()
        until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in drivers), BUSY)

    def stop(self):
        """Tell it to end; its exit status."""
        self._process.send_signal(signal.SIGTERM)
        return self._close()

    def _close(self):
        status = self._process.wait(BUSY)
        self._process.stdout.close()
        self._process = None
        return status
