"""How much memory a task may need, as the library counts it."""

from __future__ import annotations

from typing import Any

import simplifier
from service.engines.messages import Task

_GIB = 1 << 30


def memory_of(task: Task) -> int:
    """Bytes that it may take beside what its process has; its owner may have set less."""
    own = task.options.get("memory_limit")
    return task.memory if own is None else min(int(own * _GIB), task.memory)


def allowed(task: Task) -> float:
    """GiB of the whole process, a warm one."""
    return (simplifier.BASE_BYTES + memory_of(task)) / _GIB


def allowed_options(task: Task) -> dict[str, Any]:
    """The task's, with that limit."""
    return {**task.options, "memory_limit": allowed(task)}
