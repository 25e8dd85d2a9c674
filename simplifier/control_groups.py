"""What Linux allows this process: the limits of its control groups on memory and processors.

In a container these are what was asked for it, where the machine has more.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
"""Where the groups are mounted."""

MEMBERSHIP = Path("/proc/self/cgroup")
"""A file of lines "number:controllers:path", one a hierarchy."""


def allowed_processors() -> int:
    """How many processors this process may use, 1 or more: those that it may run on, or fewer where
    a group has a quota of their time, of which a part counts as a whole one."""
    if hasattr(os, "sched_getaffinity"):
        count = len(os.sched_getaffinity(0))
    else:
        count = os.cpu_count() or 1
    return max(1, min([count, *_quotas()]))


@cache
def _quotas() -> tuple[int, ...]:
    return tuple(math.ceil(one) for one in processor_limits(ROOT, MEMBERSHIP))


def processor_limits(root: Path, membership: Path) -> Iterator[float]:
    """Every quota of processors' time that binds this process, in processors, above 0."""
    for is_second, folder in group_folders("cpu", root, membership):
        with suppress(OSError, ValueError):  # no such group, or "max"
            if is_second:
                quota, period = (int(one) for one in (folder / "cpu.max").read_text().split())
            else:
                quota = int((folder / "cpu.cfs_quota_us").read_text())
                period = int((folder / "cpu.cfs_period_us").read_text())
            if quota > 0 and period > 0:  # -1 is none
                yield quota / period


def memory_limits(root: Path, membership: Path) -> Iterator[int]:
    """Every limit on the memory of this process, bytes."""
    for is_second, folder in group_folders("memory", root, membership):
        with suppress(OSError, ValueError):  # no such group, or "max"
            name = "memory.max" if is_second else "memory.limit_in_bytes"
            yield int((folder / name).read_text())


def group_folders(controller: str, root: Path, membership: Path) -> Iterator[tuple[bool, Path]]:
    """The groups in which a controller may bind this process, and whether they are of version 2.

    The groups above count as well.  In a container the path is often that of the host and is not
    there: then its own group is the root.
    """
    try:
        lines = membership.read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        is_second = controllers == ""
        if is_second or controller in controllers.split(","):
            mount, group = root if is_second else root / controller, Path(path.lstrip("/"))
            for place in (group, *group.parents):
                yield is_second, mount / place
