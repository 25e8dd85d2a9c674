"""A run that needs more than it may is refused before it begins.

How much memory there is for this process: the machine's, or what its container allows.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache

from simplifier.checks import check_above_zero
from simplifier.control_groups import MEMBERSHIP, ROOT, memory_limits
from simplifier.errors import MemoryLimitError
from simplifier.memory.need import GIB, MemoryNeed

MOST_GIB = 1_000_000.0
"""The largest limit that can be set."""

_SHARE = 0.5  # of the machine's memory, where no limit is set: others run there too


def default_limit() -> float:
    """GiB: half of the machine's memory, or of what its container may use."""
    return _SHARE * machine_memory() / GIB


def check_limit(memory_limit: float | None) -> None:
    """Raise :class:`~simplifier.errors.OptionError` for what is no limit in GiB."""
    if memory_limit is not None:
        check_above_zero("memory limit", memory_limit, MOST_GIB)


def check_need(
    need: MemoryNeed,
    memory_limit: float | None,
    *,
    where: str = "",
    resolution: int = 1,
    at: Callable[[int], MemoryNeed] | None = None,
    advise: Callable[[float], str] | None = None,
) -> None:
    """Raise :class:`~simplifier.errors.MemoryLimitError` where a run needs more than it may.

    ``memory_limit``  GiB, None for :func:`default_limit`.
    ``where``         what the run is about, for the message.
    ``at``            the need at a lower resolution than ``resolution``, to say which one fits.
    ``advise``        in its place, of runs without a resolution: from the limit in GiB what to
                      choose, as in "choose larger cells"; empty where nothing would do.
    """
    check_limit(memory_limit)
    limit = default_limit() if memory_limit is None else memory_limit
    if need.gib <= limit:
        return
    fitting = 0 if at is None else _finest(at, resolution, limit)
    advice = f"choose a resolution of at most {fitting}" if fitting else "thin the mesh"
    if advise is not None:
        advice = advise(limit)
    raise MemoryLimitError(
        f"about {need.gib:.3g} GiB of memory would be needed, most of it to {_DEEDS[need.largest]},"
        f" and the limit is {limit:.3g} GiB",
        where=where,
        remedy=f"{advice}, or set a memory limit of at least {_round_up(need.gib)}".removeprefix(
            ", or "
        ),
        resolution=fitting,
    )


_DEEDS = {
    "load": "load the mesh",
    "voxelize": "make the grid",
    "fill": "fill the grid",
    "surface": "mesh the grid",
    "sections": "cut the grid",
    "refine": "refine",
    "accuracy": "judge the occluder",
    "report": "write the report",
    "pictures": "draw pictures",
    "viewing": "show the mesh",
    "occluders": "make several occluders at once",
    "raster": "raster the heights",
    "maps": "look from the cells",
}


def _finest(at: Callable[[int], MemoryNeed], resolution: int, limit: float) -> int:
    """The largest resolution below that fits, 0 where none does; needs grow with it."""
    low, high = 0, resolution
    while high - low > 1:
        middle = (low + high) // 2
        if at(middle).gib <= limit:
            low = middle
        else:
            high = middle
    return low


def _round_up(gib: float) -> str:
    return f"{gib * 1.005 + 0.005:.2f}"


def machine_memory() -> int:
    """Bytes: the machine's memory, or the least limit of the control groups of this process."""
    return min([_installed_bytes(), *_group_limits()])


@cache
def _group_limits() -> tuple[int, ...]:
    return tuple(memory_limits(ROOT, MEMBERSHIP))


def _installed_bytes() -> int:
    with suppress(ValueError, OSError, AttributeError):  # names that a system does not know
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return sys.maxsize
