"""What a worker process cannot reach: tried from within a job, and from a process that may."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import uuid

import pytest

from service.engines import confinement, process, socket_filter
from tests.acceptance.command import ROOT
from tests.service.engines import ways_out
from tests.service.engines.workplace import Workplace
from tests.waiting import until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="by the means of Linux")

NOBODY = 65534
REFUSED = "PermissionError"
LANDLOCK = ctypes.CDLL(None).syscall(444, None, ctypes.c_size_t(0), ctypes.c_uint32(1))
SIGNALS_STAY = 6  # of Landlock's versions: since Linux 6.12
needs_landlock = pytest.mark.skipif(LANDLOCK < 2, reason="the kernel has no Landlock")


@pytest.fixture(scope="module")
def around(tmp_path_factory):
    """What listens here, and a process that any other of its user may look into."""
    path = tmp_path_factory.mktemp("listening") / "socket"
    name = f"occluder-test-{uuid.uuid4()}"
    with contextlib.ExitStack() as opened:

        def bound(family, kind, address):
            one = opened.enter_context(socket.socket(family, kind))
            one.bind(address)
            if kind == socket.SOCK_STREAM:
                one.listen(64)
            return one

        tcp = bound(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", 0))
        udp = bound(socket.AF_INET, socket.SOCK_DGRAM, ("127.0.0.1", 0))
        bound(socket.AF_UNIX, socket.SOCK_STREAM, str(path))
        bound(socket.AF_UNIX, socket.SOCK_STREAM, f"\0{name}")
        helper = opened.enter_context(
            subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
        )
        yield {
            "tcp": tcp.getsockname()[1], "udp": udp.getsockname()[1], "path": str(path),
            "name": name, "helper": helper.pid,
        }  # fmt: skip
        helper.stdin.close()


@pytest.fixture(scope="module")
def found(around, tmp_path_factory):
    """What a job of this user finds."""
    return ways_out.by_a_job(around, tmp_path_factory.mktemp("place"))


@pytest.fixture(scope="module")
def free(around):
    """What a process that is not confined finds."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.service.engines.ways_out", json.dumps(around)],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def test_no_way_leads_to_the_network(found, free):
    assert set(found["network"].values()) == {REFUSED}
    # Each of them would: but for what this machine has not, or allows nobody.
    ways = {name for name, came in free["network"].items() if came == ways_out.OPEN}
    assert ways >= free["network"].keys() - {"io_uring", "socket by number of x32"}


def test_the_server_cannot_be_looked_into(found):
    assert {found["server"][way] for way in ("environment", "map", "memory", "open files")} == {
        REFUSED
    }
    assert found["server"]["trace"] == REFUSED


@needs_landlock
def test_no_other_process_can_be_looked_into(found, free):
    refused = {way for way, came in found["helper"].items() if came == REFUSED}
    assert refused >= {"environment", "map", "memory", "open files", "trace"}
    assert {free["helper"][way] for way in ("environment", "map", "open files", "signal")} == {
        ways_out.OPEN
    }


@pytest.mark.skipif(LANDLOCK < SIGNALS_STAY, reason="the kernel lets signals through")
def test_no_other_process_can_be_ended(found):
    assert (found["server"]["signal"], found["helper"]["signal"]) == (REFUSED, REFUSED)


def test_root_keeps_no_rights_but_to_files(found):
    assert found["rights"] in (0, 1 << 1)  # CAP_DAC_OVERRIDE


def test_what_libraries_need_is_there_still(found):
    assert found["still"] == ["pair", "PROCESS", "moved"]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_all_of_it_holds_without_any_rights(around, found):
    python = shutil.which(f"python{sys.version_info[0]}.{sys.version_info[1]}", path="/usr/bin")
    command = [python or sys.executable, "-m", "tests.service.engines.ways_out"]
    with tempfile.TemporaryDirectory() as folder:
        os.chown(folder, NOBODY, NOBODY)
        try:
            done = subprocess.run(
                [*command, json.dumps(around), folder], user=NOBODY, group=NOBODY,
                extra_groups=[], cwd=ROOT, capture_output=True, text=True, check=False,
                env={"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "TMPDIR": folder},
            )  # fmt: skip
        except PermissionError:
            pytest.skip("nobody may run this Python")
    assert done.returncode == 0, done.stderr
    theirs = json.loads(done.stdout)
    assert theirs["network"] == found["network"]
    assert theirs["server"] == found["server"]
    assert (theirs["rights"], theirs["still"]) == (0, found["still"])


def test_what_a_system_cannot_close_is_told_once(tmp_path, caplog, monkeypatch):
    """As on a processor whose calls the filter does not know."""
    (tmp_path / "sitecustomize.py").write_text(
        "from service.engines import socket_filter\nsocket_filter._ARCHITECTURES.clear()\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    process._tell_unconfined.cache_clear()
    place = Workplace(tmp_path / "place", workers=2)
    with place.open():
        place.end_of(place.submit())
        until(lambda: place.engine.live == 2)
    told = [one.getMessage() for one in caplog.records if "no way to keep" in one.getMessage()]
    assert len(told) == 1
    assert "can reach the network" in told[0]


def test_a_domain_in_which_no_file_can_be_moved_is_not_entered(monkeypatch):
    """As on Linux 5.15: results are moved from folder to folder."""
    asked = []
    monkeypatch.setattr(confinement, "_call", lambda *call: asked.append(call) or 1)
    assert not confinement._leave_others()
    assert len(asked) == 1


def test_a_processor_whose_calls_are_not_known_is_not_filtered(monkeypatch):
    monkeypatch.setattr(socket_filter, "_ARCHITECTURES", {})
    assert not socket_filter.refuse_sockets()
