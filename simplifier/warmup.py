"""Compile all kernels before anybody waits for one."""

from __future__ import annotations

from simplifier.kernels.compiled.library import load_all
from simplifier.kernels.native import library


def warm_up() -> None:
    """Compile every kernel whose machine code is not there yet, on all processors, and load all.

    Among them are the C headers, where there is a compiler for them.  The code is kept: a later
    process of the same user on the same processor compiles nothing.
    """
    load_all()
    library()
