"""What a worker process may reach: its files and its server's socket, and nothing else.

It reads files from anyone, by libraries in C, so it has to be taken for somebody else's.  Before
it reads anything it gives up, for good, for itself and for all that it starts:

- sockets, by a filter of system calls (:mod:`service.engines.socket_filter`);
- a look into other processes and signals to them, by a domain of Landlock
  (https://docs.kernel.org/userspace-api/landlock.html), whatever user and rights they have;
- what root may do beyond its files, by its capabilities.

All three need no rights and work for root in a container as well; namespaces, which containers and
many systems forbid, are not needed.  The server for its part cannot be looked into
(:func:`hide_memory`), also where there is no Landlock.
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from service.engines.socket_filter import refuse_sockets

_NICE = 5
_OOM_SCORE = "500"

# linux/prctl.h
_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_SET_NO_NEW_PRIVS = 1, 4, 38

# linux/landlock.h; the numbers of its calls are the same on every processor.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_MAKE_CHAR, _MAKE_BLOCK, _REFER = 1 << 6, 1 << 11, 1 << 13
_SCOPE_ABSTRACT_SOCKETS, _SCOPE_SIGNALS = 1 << 0, 1 << 1
_PATH_BENEATH = 1
_LEAST_VERSION = 2
"""Of Linux 5.19.  In a domain of the first one no file can be moved from folder to folder, as
results are."""

# linux/capability.h
_CAPABILITIES_VERSION, _CAP_DAC_OVERRIDE = 0x20080522, 1 << 1


def confine() -> tuple[str, ...]:
    """Yield to the server, write files that nobody else can read, leave no core, die with it, and
    reach nothing.  For the one thread of a process that has just begun.

    Returns in words what could not be closed: "reach the network", where a system has no way.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its own
    os.umask(0o077)
    os.nice(_NICE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        # When memory runs out on the machine, workers go before the server does.
        with suppress(OSError):  # a container may show /proc without letting anyone write to it
            Path("/proc/self/oom_score_adj").write_text(_OOM_SCORE)
        _prctl(_PR_SET_NO_NEW_PRIVS, 1)
        _drop_capabilities()
    left = tuple(_left_open())
    if sys.platform == "linux":
        # The signal comes when the thread that started this process ends, even by kill -9, and
        # even while a kernel keeps every thread here from running.  Last, for a change of rights
        # may take it back.
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    return left


def hide_memory() -> None:
    """Keep other processes of this user out of this one: its environment, memory and open files.

    It leaves no core then, and debuggers need root.  Nothing happens where the system has no such
    call.
    """
    if sys.platform == "linux":
        _prctl(_PR_SET_DUMPABLE, 0)


def _left_open() -> Iterator[str]:
    if not refuse_sockets():
        yield "reach the network"
    if not _leave_others():
        yield "look into other processes of their user"


def _leave_others() -> bool:
    """Enter a domain from which no process outside of it can be traced, read or sent a signal.

    Whether the kernel has such domains; signals are Linux 6.12's.
    """
    if sys.platform != "linux":
        return False
    version = _call(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(1))
    if version < _LEAST_VERSION:
        return False
    # A domain has to forbid something: devices, which nobody makes here.
    handled = _MAKE_CHAR | _MAKE_BLOCK | _REFER
    # Kernels that claim version 6 may lack its scopes: RHEL 9.
    for scopes in (_SCOPE_SIGNALS | _SCOPE_ABSTRACT_SOCKETS, 0):
        attributes = (ctypes.c_uint64 * 3)(handled, 0, scopes)
        size = ctypes.sizeof(attributes) if scopes else ctypes.sizeof(ctypes.c_uint64)
        ruleset = _call(
            _CREATE_RULESET, ctypes.byref(attributes), ctypes.c_size_t(size), ctypes.c_uint32(0)
        )
        if ruleset >= 0:
            break
    else:
        return False
    try:
        if not _allow_below_root(ruleset, _REFER):
            return False
        return _call(_RESTRICT_SELF, ctypes.c_int(ruleset), ctypes.c_uint32(0)) == 0
    finally:
        os.close(ruleset)


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = (("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32))


def _allow_below_root(ruleset: int, rights: int) -> bool:
    root = os.open("/", os.O_PATH | os.O_CLOEXEC)
    try:
        rule = _PathBeneath(rights, root)
        added = _call(
            _ADD_RULE, ctypes.c_int(ruleset), ctypes.c_int(_PATH_BENEATH), ctypes.byref(rule),
            ctypes.c_uint32(0),
        )  # fmt: skip
        return added == 0
    finally:
        os.close(root)


class _CapabilityHeader(ctypes.Structure):
    _fields_ = (("version", ctypes.c_uint32), ("pid", ctypes.c_int))


class _CapabilitySet(ctypes.Structure):
    _fields_ = (
        ("effective", ctypes.c_uint32),
        ("permitted", ctypes.c_uint32),
        ("inheritable", ctypes.c_uint32),
    )


def _drop_capabilities() -> None:
    """Keep of root's rights that to its files alone: the program may lie in another's folder.

    Programs that it starts gain none again, since it has asked for no new privileges.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    header, sets = _CapabilityHeader(_CAPABILITIES_VERSION, 0), (_CapabilitySet * 2)()
    libc.capget(ctypes.byref(header), sets)
    kept = sets[0].permitted & _CAP_DAC_OVERRIDE
    sets[0] = _CapabilitySet(kept, kept, 0)
    sets[1] = _CapabilitySet(0, 0, 0)
    libc.capset(ctypes.byref(header), sets)


def _prctl(option: int, value: int) -> None:
    zero = ctypes.c_ulong(0)
    ctypes.CDLL(None).prctl(ctypes.c_int(option), ctypes.c_ulong(value), zero, zero, zero)


def _call(number: int, *arguments: object) -> int:
    """A system call that the library of C has no function for; -1 where it fails."""
    result: int = ctypes.CDLL(None).syscall(ctypes.c_long(number), *arguments)
    return result
