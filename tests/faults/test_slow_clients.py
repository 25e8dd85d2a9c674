"""Clients that take for ever, by hundreds: nobody else notices."""

from __future__ import annotations

import random
import resource
import socket
import statistics
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from itertools import chain, cycle, islice

import pytest

from tests.faults.serving import memory_of
from tests.service.real import BOX

LARGE = BOX + b"# " + random.Random(1).randbytes(2 << 20).hex().encode() + b"\n"
MIB = 1 << 20

_ANSWERS = 30  # at least: a machine that stands still for seconds is in few of them


class Slow:
    """A connection that sends, or takes, a byte each time that it has a turn."""

    def __init__(self, server, sent, drip=b""):
        """``drip``  what is sent over and over; nothing takes in place of sending."""
        host, port = server.address.removeprefix("http://").split(":")
        self._socket = socket.socket()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self._socket.connect((host, int(port)))
        self._socket.sendall(sent)
        self._socket.setblocking(False)
        self._drip = cycle(drip) if drip else None

    def turn(self):
        with suppress(OSError):  # it may have been hung up on, or nothing has come
            if self._drip is None:
                self._socket.recv(1)
            else:
                self._socket.send(bytes([next(self._drip)]))

    def is_over(self):
        """Whether the server has hung up; of one that has sent no whole request."""
        with suppress(BlockingIOError):
            with suppress(ConnectionError):
                self._socket.recv(1, socket.MSG_PEEK)
            return True
        return False

    def close(self):
        self._socket.close()


def kinds(server, job_id):
    """Of slow clients: what they send at first, and then byte by byte."""
    host = f"Host: {server.address.removeprefix('http://')}\r\n".encode()
    post = b"POST /v1/occluders?filename=a.obj HTTP/1.1\r\n" + host
    file = f"GET /v1/jobs/{job_id}/files/lod0.obj HTTP/1.1\r\n".encode() + host
    listed = b"GET /v1/jobs?limit=100 HTTP/1.1\r\n" + host
    return {
        "idle": (b"",),
        "headers": (post, b"X-Slow: 1\r\n"),
        "body": (post + b"Content-Length: 1000000\r\n\r\n" + BOX, b"# "),
        "chunks": (post + b"Transfer-Encoding: chunked\r\n\r\n", b"1\r\n#\r\n"),
        "file": (file + b"\r\n",),
        "events": (listed.replace(b"?limit=100", f"/{job_id}/events".encode()) + b"\r\n",),
        "list": (listed + b"\r\n",),
    }


@contextmanager
def slow_clients(server, job_id, count):
    """So many, of each kind, who have a turn once a second; by kind."""
    made = {name: [] for name in kinds(server, job_id)}
    end = threading.Event()
    with ExitStack() as stack:
        for name, said in islice(cycle(kinds(server, job_id).items()), count):
            made[name].append(Slow(server, *said))
            stack.callback(made[name][-1].close)

        def drip():
            while not end.wait(1.0):
                for one in chain(*made.values()):
                    one.turn()

        thread = threading.Thread(target=drip)
        thread.start()
        stack.callback(thread.join)
        stack.callback(end.set)
        yield made


@pytest.fixture
def many_files():
    """Leave to open as many as the system allows."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.parametrize(
    ("count", "seconds"),
    [
        pytest.param(210, 3.0, id="short"),
        pytest.param(1001, 40.0, id="long", marks=pytest.mark.faults),
    ],
)
@pytest.mark.usefixtures("many_files")
def test_others_are_answered_soon_and_memory_stays_bounded(server, count, seconds):
    serving = server(OCCLUDER_WORKERS="1").start()
    job_id = serving.post(body=LARGE).json()["id"]
    serving.end_of(job_id)
    before = memory_of(serving.process.pid)
    times, most = [], 0
    with slow_clients(serving, job_id, count) as slow:
        end = time.monotonic() + seconds
        while time.monotonic() < end or len(times) < _ANSWERS:
            begin = time.monotonic()
            assert serving.job(job_id)["state"] == "succeeded"
            times.append(time.monotonic() - begin)
            time.sleep(0.02)  # without a pause, both ends of this are busy with it alone
            most = max(most, memory_of(serving.process.pid))
        assert serving.end_of(serving.submit())["state"] == "succeeded"
        # What is no request yet is hung up on in the end.
        over = [one.is_over() for one in slow["idle"] + slow["headers"]]
    median = statistics.median(times)
    assert median < 0.1
    assert most < 200 * MIB
    assert all(over) or seconds < 30.0
    assert serving.end_of(serving.submit("# after"))["state"] == "succeeded"
    assert "Traceback" not in serving.log
    print(
        f"{count} slow clients for {seconds:.0f} s: status in {median * 1e3:.1f} ms (median of "
        f"{len(times)}), {max(times) * 1e3:.0f} ms at most; server memory "
        f"{before / MIB:.0f} MiB before, {most / MIB:.0f} MiB at most; {sum(over)} hung up on"
    )
