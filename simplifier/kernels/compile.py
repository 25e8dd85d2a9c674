"""The one decorator that all kernels wear."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile on first call, keep the machine code on disk, release the interpreter's lock.

    ``error_model="numpy"`` drops the check for division by zero, which keeps loops vectorizable;
    kernels guard their own divisions.  ``fastmath`` stays off: the same input must give the same
    bytes on every machine of a kind.
    """
    compiled: Function = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


def inline_kernel(function: Function) -> Function:
    """As :func:`kernel`, for small functions that other kernels call in their inner loops."""
    compiled: Function = numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")(
        function
    )
    return compiled
