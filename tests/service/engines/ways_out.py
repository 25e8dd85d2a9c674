"""Ways out of a process, tried one by one; a name and what came of it each.

``python -m tests.service.engines.ways_out AROUND`` prints them as JSON; with a folder behind that
they are what a job finds.
"""

from __future__ import annotations

import ctypes
import json
import os
import platform
import socket
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

OPEN = "open"
_GENERIC = {"socket": 198, "process_vm_readv": 270, "ptrace": 117}
_NUMBERS = {
    "x86_64": {"socket": 41, "process_vm_readv": 310, "ptrace": 101},
    "aarch64": _GENERIC,
    "riscv64": _GENERIC,
}
_IO_URING_SETUP = 425
_X32 = 0x40000000
_PTRACE_ATTACH, _PTRACE_DETACH = 16, 17


def call(name, *arguments, foreign=0):
    number = name if isinstance(name, int) else _NUMBERS[platform.machine()][name]
    libc = ctypes.CDLL(None, use_errno=True)
    result = libc.syscall(ctypes.c_long(number | foreign), *arguments)
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def connect(family, address):
    with socket.socket(family, socket.SOCK_STREAM) as one:
        one.connect(address)


def datagram(port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.sendto(b"x", ("127.0.0.1", port))


def netlink():
    socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0).close()


def pair_of_datagrams():
    """Either of them could be sent elsewhere later."""
    for one in socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM):
        one.close()


def rings():
    """Which make sockets without any call of that name."""
    parameters = (ctypes.c_uint32 * 30)()
    os.close(call(_IO_URING_SETUP, ctypes.c_uint(2), ctypes.byref(parameters)))


def raw():
    os.close(call("socket", socket.AF_INET, socket.SOCK_STREAM, 0))


def raw_of_x32():
    os.close(call("socket", socket.AF_INET, socket.SOCK_STREAM, 0, foreign=_X32))


def by_a_program(port):
    """Started by this process, so that it is another one."""
    script = f"import socket; socket.create_connection(('127.0.0.1', {port}))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise PermissionError(done.stderr) if "PermissionError" in done.stderr else OSError


def file_of(pid, name):
    Path(f"/proc/{pid}/{name}").read_bytes()


def memory_of(pid):
    with Path(f"/proc/{pid}/mem").open("rb"):
        pass


def files_of(pid):
    """What they are; root may list their numbers."""
    folder = f"/proc/{pid}/fd"
    for number in os.listdir(folder):  # noqa: PTH208
        os.readlink(f"{folder}/{number}")  # noqa: PTH115


def trace(pid):
    call("ptrace", ctypes.c_long(_PTRACE_ATTACH), ctypes.c_long(pid), None, None)
    os.waitpid(pid, 0)
    call("ptrace", ctypes.c_long(_PTRACE_DETACH), ctypes.c_long(pid), None, None)


def signal_to(pid):
    os.kill(pid, 0)


def outcome(way, *arguments):
    try:
        way(*arguments)
    except OSError as error:
        return type(error).__name__
    return OPEN


def to_the_network(around):
    """``around``: ports, paths and names of what listens."""
    ways = {
        "tcp": (connect, socket.AF_INET, ("127.0.0.1", around["tcp"])),
        "tcp by another program": (by_a_program, around["tcp"]),
        "udp": (datagram, around["udp"]),
        "netlink": (netlink,),
        "socket in a folder": (connect, socket.AF_UNIX, around["path"]),
        "socket by name": (connect, socket.AF_UNIX, f"\0{around['name']}"),
        "pair of datagrams": (pair_of_datagrams,),
        "io_uring": (rings,),
        "socket by number": (raw,),
    }
    if platform.machine() == "x86_64":
        ways["socket by number of x32"] = (raw_of_x32,)
    return {name: outcome(*way) for name, way in ways.items()}


def into(pid):
    """What can be had of another process."""
    ways = {
        "environment": (file_of, pid, "environ"),
        "map": (file_of, pid, "maps"),
        "memory": (memory_of, pid),
        "open files": (files_of, pid),
        "trace": (trace, pid),
        "signal": (signal_to, pid),
    }
    return {name: outcome(*way) for name, way in ways.items()}


def found(around):
    """What can be had of the network, of the server and of a helper of its."""
    return {
        "network": to_the_network(around),
        "server": into(os.getppid()),
        "helper": into(around["helper"]),
        "rights": capabilities(),
        "still": still_there(),
    }


def capabilities():
    """Those that count: a number of bits."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1], 16) for line in lines if line.startswith("CapEff"))


def still_there():
    """What libraries need, and have: pairs of streams, processes, files moved between folders."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.send(b"pair")
        pair = theirs.recv(4).decode()
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        process = pool.submit(str.upper, "process").result()
    with tempfile.TemporaryDirectory() as here, tempfile.TemporaryDirectory() as there:
        file = Path(here) / "file"
        file.write_text("moved")
        file.rename(Path(there) / "file")
        return [pair, process, (Path(there) / "file").read_text()]


def by_a_job(around, folder):
    """What a job of an engine in this process finds."""
    from tests.service.engines.workplace import Workplace

    place = Workplace(Path(folder), workers=1)
    with place.open():
        job = place.end_of(place.submit("look_around", around=around), 120.0)
        return json.loads(place.results(job.id)["found.json"])


if __name__ == "__main__":
    look = by_a_job if len(sys.argv) > 2 else found
    print(json.dumps(look(json.loads(sys.argv[1]), *sys.argv[2:])))
