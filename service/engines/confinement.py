"""What a worker process may do to the machine, set by itself before it reads anything.

The server sees to the rest: it starts the process in a group of its own, so that one signal ends
all that it starts, and watches its memory and its time.
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
from contextlib import suppress
from pathlib import Path

_NICE = 5
_PR_SET_PDEATHSIG = 1
_OOM_SCORE = "500"


def confine() -> None:
    """Yield to the server, write files that nobody else can read, leave no core, die with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its own
    os.umask(0o077)
    os.nice(_NICE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        # The signal comes when the thread that started this process ends, even by kill -9, and
        # even while a kernel keeps every thread here from running.
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        # When memory runs out on the machine, workers go before the server does.
        with suppress(OSError):  # a container may show /proc without letting anyone write to it
            Path("/proc/self/oom_score_adj").write_text(_OOM_SCORE)


def allow_memory(more: int) -> None:
    """Let this process take so many bytes beside what it has; beyond is a MemoryError.

    RLIMIT_DATA counts private writable memory.  RLIMIT_AS would count what is only reserved as
    well, several hundred megabytes for a handful of threads.
    """
    if sys.platform != "linux":
        return
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    wanted = _data_bytes() + more
    soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _data_bytes() -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmData:"):
            return int(line.split()[1]) * 1024
    return 0


def end_group() -> None:
    """End this process and all that it has started, at once."""
    try:
        if os.getpgrp() == os.getpid():
            os.killpg(0, signal.SIGKILL)
    finally:
        os._exit(1)
