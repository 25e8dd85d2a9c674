"""A filter of system calls that lets a process have no socket but pairs of its own.

It is a program of classic BPF that the kernel runs before each call (seccomp(2); its man page says
what a call looks like to it).  What it refuses fails with EPERM, so libraries that would ask a
daemon something see that they cannot.  Refused are ``socket``, ``connect``, ``bind``, ``listen``,
``accept``, pairs that are no streams, since others can be turned to another address later, and
``io_uring``, by which sockets can be made without any of these.  Pairs of streams are needed by
multiprocessing.

Internet sockets alone would not do: PostgreSQL, Docker and others listen on sockets in folders,
and believe whoever has the right user.
"""

from __future__ import annotations

import ctypes
import os
import socket
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class _Architecture:
    """Numbers of a processor's calls: linux/audit.h and asm/unistd.h.

    ``first_foreign``  from where on they belong to another convention: x32 of x86-64.
    """

    audit: int
    seccomp: int
    refused: tuple[int, ...]
    socketpair: int
    first_foreign: int | None = None


_IO_URING_SETUP = 425
# socket, bind, listen, accept, connect, accept4: as all processors since aarch64 number them.
_RECENT = (198, 200, 201, 202, 203, 242, _IO_URING_SETUP)
_ARCHITECTURES = {
    "x86_64": _Architecture(
        0xC000003E, 317, (41, 42, 43, 49, 50, 288, _IO_URING_SETUP), 53, 0x40000000
    ),
    "aarch64": _Architecture(0xC00000B7, 277, _RECENT, 199),
    "riscv64": _Architecture(0xC00000F3, 277, _RECENT, 199),
}

_SET_MODE_FILTER, _ALL_THREADS, _SPECULATION_ALLOWED = 1, 1, 4

_LOAD, _EQUAL, _AT_LEAST, _AND, _RETURN = 0x20, 0x15, 0x35, 0x54, 0x06
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050001, 0x80000000  # refusing is EPERM, 1
_NUMBER, _AUDIT, _FIRST, _SECOND = 0, 4, 16, 24  # places in struct seccomp_data
_TYPE_OF_SOCKET = 0xF  # the other bits are flags


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("steps", ctypes.c_char_p))


def refuse_sockets() -> bool:
    """Give up sockets, in all threads and in whatever this process starts; whether that worked.

    The process has to have asked for no new privileges before.
    """
    architecture = _ARCHITECTURES.get(os.uname().machine)
    if sys.platform != "linux" or architecture is None or sys.maxsize < 1 << 32:
        return False
    steps = b"".join(_steps(architecture))
    program = _Program(len(steps) // 8, steps)
    # Without the second flag older kernels switch off a kind of speculation for the process, which
    # costs kernels of ours several percent.
    flags = _ALL_THREADS | _SPECULATION_ALLOWED
    result: int = ctypes.CDLL(None).syscall(
        ctypes.c_long(architecture.seccomp), ctypes.c_uint(_SET_MODE_FILTER), ctypes.c_uint(flags),
        ctypes.byref(program),
    )  # fmt: skip
    return result == 0


def _steps(architecture: _Architecture) -> Iterator[bytes]:
    """The program: a step is a code, how many steps to skip if true and if not, and a value."""
    # Numbers of another processor's calls would mean something else.
    yield _step(_LOAD, _AUDIT)
    yield _step(_EQUAL, architecture.audit, true=1)
    yield _step(_RETURN, _KILL)
    yield _step(_LOAD, _NUMBER)
    if architecture.first_foreign is not None:
        yield _step(_AT_LEAST, architecture.first_foreign, false=1)
        yield _step(_RETURN, _REFUSE)
    for number in architecture.refused:
        yield _step(_EQUAL, number, false=1)
        yield _step(_RETURN, _REFUSE)
    yield _step(_EQUAL, architecture.socketpair, true=1)
    yield _step(_RETURN, _ALLOW)
    yield _step(_LOAD, _FIRST)
    yield _step(_EQUAL, socket.AF_UNIX, true=1)
    yield _step(_RETURN, _REFUSE)
    yield _step(_LOAD, _SECOND)
    yield _step(_AND, _TYPE_OF_SOCKET)
    yield _step(_EQUAL, socket.SOCK_STREAM, true=1)
    yield _step(_RETURN, _REFUSE)
    yield _step(_RETURN, _ALLOW)


def _step(code: int, value: int, *, true: int = 0, false: int = 0) -> bytes:
    return struct.pack("=HBBI", code, true, false, value)
