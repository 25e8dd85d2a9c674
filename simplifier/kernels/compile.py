"""The one decorator that all kernels wear."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TypeVar

import numba
from numba.np import linalg

Function = TypeVar("Function", bound=Callable[..., object])


def _load_arrays() -> None:
    """Load numba's arrays as the first kernel would, but without all of ``scipy.linalg``.

    They import it to see whether there is a BLAS: a quarter of a second at every start.  A kernel
    that multiplies matrices, which none here does, would still look for it when it is compiled.
    """
    look = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = look


_load_arrays()


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
