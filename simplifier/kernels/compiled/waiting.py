"""Kernel files whose machine code is not in place yet.

Apart from the kernels, for those who only count threads: they need no numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

Load = Callable[[Sequence[str]], object]

waiting: dict[str, Load] = {}
"""Files that are imported, by name, and what puts the machine code of such files in place."""


def load_imported() -> None:
    """Put the machine code of all kernel files that are imported in place.

    What is missing is compiled before, here and now: the caller's thread hears Ctrl-C.
    """
    if waiting:
        load = next(iter(waiting.values()))
        load(sorted(waiting))
