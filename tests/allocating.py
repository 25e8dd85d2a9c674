"""The most memory that a call allocates at once."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable


def most_allocated(call: Callable[[], object]) -> int:
    """Bytes, the arrays of numpy among them.

    The call is made twice and counted once: the first one loads modules, whose source takes
    megabytes where no byte code lies beside it.
    """
    call()
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
