"""How much memory there is for this process: the machine's, or what its container allows."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_ROOT = Path("/sys/fs/cgroup")
_MEMBERSHIP = Path("/proc/self/cgroup")


def machine_memory() -> int:
    """Bytes: the machine's memory, or the least limit of the control groups of this process."""
    return min([_installed(), *cgroup_limits(_ROOT, _MEMBERSHIP)])


def _installed() -> int:
    with suppress(ValueError, OSError, AttributeError):  # names that a system does not know
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return sys.maxsize


def cgroup_limits(root: Path, membership: Path) -> Iterator[int]:
    """Every limit on the memory of this process, bytes, of version 2 and of version 1.

    ``root``        where the groups are mounted.
    ``membership``  a file of lines "number:controllers:path", one a hierarchy.

    The groups above count as well.  In a container the path is often that of the host and is not
    there: then its own group is the root.  Limits that are none ("max") are left out.
    """
    try:
        lines = membership.read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            yield from _limits(root, path, "memory.max")
        elif "memory" in controllers.split(","):
            yield from _limits(root / "memory", path, "memory.limit_in_bytes")


def _limits(mount: Path, path: str, name: str) -> Iterator[int]:
    group = Path(path.lstrip("/"))
    for place in (group, *group.parents):
        with suppress(OSError, ValueError):  # no such group, or "max"
            yield int((mount / place / name).read_text())
