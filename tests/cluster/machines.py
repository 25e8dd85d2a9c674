"""A cluster on this machine: servers, workers, database and bucket, each to be hurt alone.

Each server and each worker has a folder of its own and reaches the bucket by a proxy of its own, so
that it is seen what each of them asks of it.
"""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
from contextlib import ExitStack, suppress
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.acceptance.command import OCCLUDER, environment
from tests.faults.serving import Server
from tests.postgres import PostgresServer
from tests.s3 import running_localbucket
from tests.s3_proxy import proxy_of
from tests.waiting import BUSY, until

# Not imported to find out: it reads its settings then, and tests of a pool have theirs later.
NEEDS_RAY = pytest.mark.skipif(
    find_spec("ray") is None, reason="needs the extra [ray]: make test-cluster installs it"
)
LEASE_SECONDS = 3


class Host:
    """``occluder work`` and all that it has started."""

    def __init__(self, declared, data, variables, proxy):
        self.data, self.proxy = data, proxy
        self._environment = environment(PYTHONPATH=declared, **variables)
        self._process = None

    @property
    def log(self):
        """What all of its lives have written."""
        return self.data.with_suffix(".log").read_text()

    @property
    def workers(self):
        """Process ids of those that do its jobs."""
        return children_of(self._process.pid)

    def start(self):
        with self.data.with_suffix(".log").open("a") as log:
            self._process = subprocess.Popen(
                [*OCCLUDER, "work", "--data", self.data], stdout=subprocess.PIPE, stderr=log,
                text=True, env=self._environment,
            )  # fmt: skip
        line = self._process.stdout.readline()
        assert line.startswith("occluder works"), self.log
        return self

    def tree(self):
        """Process ids: its own first."""
        return tree_of(self._process.pid)

    def kill(self):
        """All of it at once, as the loss of the machine does."""
        if self._process is None:
            return
        self.tell(signal.SIGKILL)
        self._process.wait()
        self._process.stdout.close()
        self._process = None

    def tell(self, number):
        """Send all of it a signal."""
        for pid in self.tree():
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    def stop(self):
        """Tell it to end."""
        self._process.send_signal(signal.SIGTERM)
        assert self._process.wait(BUSY) == 0, self.log


class Cluster:
    """``servers`` that do no jobs, and ``hosts`` that do; all are started.

    ``postgres``, ``s3``  what they share; each can be killed and started again.
    ``address``           of the database.
    ``shared``            the settings of all that do its jobs.
    ``objects``           the folder of the bucket.
    """

    def __init__(
        self,
        declared,
        folder,
        *,
        hosts,
        servers=2,
        engine="none",
        last_disk=None,
        prepare=None,
        **variables,
    ):
        """``prepare``  called with the address of the database before anything is started.

        ``engine``  of the servers.
        """
        self._parts = ExitStack()
        try:
            self._open(declared, folder, hosts, servers, engine, last_disk, prepare, variables)
        except BaseException:
            self.close()
            raise

    def _open(self, declared, folder, hosts, servers, engine, last_disk, prepare, variables):
        self.postgres = PostgresServer(durable=True)
        self._parts.callback(self.postgres.stop)
        self.address = self.postgres.database()
        if prepare is not None:
            prepare(self.address)
        store = folder / "s3"
        store.mkdir()
        self.s3 = self._parts.enter_context(running_localbucket(store))
        bucket = self.s3.new_bucket()
        self.objects = store / bucket / "studio"
        secret = folder / "secret"
        secret.write_bytes(os.urandom(32))
        secret.chmod(0o600)
        shared = self.shared = {
            **self.s3.variables, **variables,
            "OCCLUDER_DATABASE_URL": self.address,
            "OCCLUDER_BLOBS": f"s3://{bucket}/studio",
            "OCCLUDER_LEASE_SECONDS": str(LEASE_SECONDS),
            "OCCLUDER_WORKERS": "1",
        }  # fmt: skip
        self.servers, self.proxies = [], []
        for number in range(servers):
            proxy = self._proxy()
            serving = Server(
                declared, folder / f"server-{number}",
                **shared | {
                    "OCCLUDER_ENGINE": engine, "OCCLUDER_SECRET_FILE": str(secret),
                    "OCCLUDER_DASHBOARD": "false", "AWS_ENDPOINT_URL": proxy.address,
                },
            )  # fmt: skip
            self._parts.callback(serving.kill)
            self.servers.append(serving.start())
            self.proxies.append(proxy)
        self.hosts = []
        for number in range(hosts):
            proxy = self._proxy()
            last = number == hosts - 1
            data = last_disk / "data" if last and last_disk else folder / f"host-{number}"
            host = Host(declared, data, shared | {"AWS_ENDPOINT_URL": proxy.address}, proxy)
            self._parts.callback(host.kill)
            self.hosts.append(host.start())
            self.proxies.append(proxy)
        self._turns = itertools.cycle(self.servers)
        for serving in self.servers:
            until(serving.is_ready, BUSY)

    def _proxy(self):
        return self._parts.enter_context(proxy_of(self.s3))

    def post(self, path, body=b"", headers=None):
        """Ask the servers by turns."""
        return next(self._turns).post(path, body, headers)

    def rows(self, statement):
        """What the database says."""
        return self.postgres.execute(statement, self.address.rpartition("/")[2])

    def close(self):
        self._parts.close()


def tree_of(pid):
    """Process ids of a process and all that it has started: its own first."""
    found = [pid]
    for one in found:
        found += children_of(one)
    return found


def named_in(pid, name):
    """Of that tree, the processes whose command begins so."""
    found = []
    for one in tree_of(pid):
        with suppress(OSError):
            command = Path(f"/proc/{one}/cmdline").read_bytes().split(b"\0")[0].decode()
            if Path(command.partition(" ")[0]).name.startswith(name):
                found.append(one)
    return found


def kill_tree(pid):
    """All of it at once, as the loss of a machine does."""
    for one in tree_of(pid):
        with suppress(ProcessLookupError):
            os.kill(one, signal.SIGKILL)


def children_of(pid):
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    found = []
    for task in tasks:
        with suppress(OSError):
            found += [int(child) for child in task.read_text().split()]
    return found
