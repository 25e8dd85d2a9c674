"""What strangers can do before anybody knows who they are: nobody else notices."""

from __future__ import annotations

import asyncio
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress

import pytest

from tests.faults.serving import memory_of

MIB = 1 << 20
PIECE = 1 << 18
ENDLESS = b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Endless: "


async def flood(server, size):
    """Send one header of so many bytes, whatever comes back: the answer."""
    host, port = server.address.removeprefix("http://").split(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    answer = asyncio.create_task(reader.read())
    with suppress(ConnectionError):
        writer.write(ENDLESS)
        for _ in range(size // PIECE):
            writer.write(b"y" * PIECE)
            await writer.drain()
    with closing(writer):
        return await answer


async def floods(server, size, count):
    """The answers to so many at once."""
    return await asyncio.gather(*[flood(server, size) for _ in range(count)])


def connect(server, receive_buffer=0):
    host, port = server.address.removeprefix("http://").split(":")
    connection = socket.socket()
    if receive_buffer:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    connection.connect((host, int(port)))
    return connection


@pytest.mark.parametrize(
    ("connections", "size"),
    [
        pytest.param(3, 16 * MIB, id="short"),
        pytest.param(4, 64 * MIB, id="long", marks=pytest.mark.faults),
        pytest.param(100, 4 * MIB, id="many", marks=pytest.mark.faults),
    ],
)
def test_a_flood_of_headers_is_refused_while_others_are_answered(server, connections, size):
    serving = server(OCCLUDER_WORKERS="1").start()
    assert serving.get("/healthz").status_code == 200
    pid, times = serving.process.pid, []
    before = most = memory_of(pid)
    with ThreadPoolExecutor(1) as thread:
        flooding = thread.submit(asyncio.run, floods(serving, size, connections))
        while not flooding.done():
            begin = time.monotonic()
            assert serving.get("/healthz").status_code == 200
            times.append(time.monotonic() - begin)
            time.sleep(0.01)
            most = max(most, memory_of(pid))
        refused = flooding.result()
    assert max(times) < 2.0
    assert most - before < 32 * MIB
    assert all(answer.startswith(b"HTTP/1.1 431") for answer in refused)
    counted = f'occluder_connections_ended_total{{reason="headers-too-large"}} {connections}.0'
    assert counted in serving.get("/metrics").text
    print(
        f"{connections} connections with a header of {size // MIB} MiB: /healthz within "
        f"{max(times) * 1e3:.0f} ms; server memory {before / MIB:.0f} MiB before, "
        f"{most / MIB:.0f} MiB at most"
    )


@pytest.mark.faults
def test_downloads_that_stall_are_ended_and_one_that_is_slow_is_not(server):
    serving = server(OCCLUDER_WORKERS="1", OCCLUDER_DOWNLOAD_IDLE_SECONDS="3").start()
    job_id = serving.submit("# " + "x" * (16 * MIB))
    serving.end_of(job_id)
    # What was sent is a file of the job, and larger than any buffer on the way.
    asked = f"GET /v1/jobs/{job_id}/files/input/mesh.obj HTTP/1.1\r\nHost: localhost\r\n\r\n"
    counted = 'occluder_connections_ended_total{reason="download-stalled"} 60.0'
    with ExitStack() as stack:
        for _ in range(60):
            connection = stack.enter_context(connect(serving, receive_buffer=4096))
            connection.sendall(asked.encode())
        slow = stack.enter_context(connect(serving, receive_buffer=4096))
        slow.sendall(asked.encode())
        began, taken = time.monotonic(), 0
        while counted not in (told := serving.get("/metrics").text):
            assert time.monotonic() - began < 30.0, told
            taken += len(slow.recv(1 << 16))
            time.sleep(0.2)
        seconds = time.monotonic() - began
        slow.settimeout(10.0)
        while taken < 16 * MIB:  # the rest of it comes, after twice as long as nothing may
            piece = slow.recv(1 << 20)
            assert piece, f"ended after {taken:,} bytes"
            taken += len(piece)
            if time.monotonic() - began < 2 * seconds:
                time.sleep(0.05)
    assert "Traceback" not in serving.log
    print(
        f"60 stalled downloads were ended within {seconds:.1f} s, at a limit of 3; a slow one came "
        f"to its end in {time.monotonic() - began:.1f} s"
    )
