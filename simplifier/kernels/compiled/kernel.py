"""The decorators that kernels wear, and what they give: functions of machine code.

A kernel that Python calls says what it takes (:mod:`simplifier.kernels.compiled.signature`).  Its
first call takes the machine code of its file, which is compiled once (``library.py``), in two
processes where there are two processors, and kept.  Others are called by kernels alone and are
compiled with them; when a test calls one, numba compiles it there and then for what it was given.

numba is imported only where something is compiled.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from functools import cached_property, partial, update_wrapper
from typing import Any, ClassVar, TypeVar, cast

from simplifier.kernels.compiled.signature import Group, misfit, parse_signature
from simplifier.kernels.compiled.waiting import load_imported, waiting

Function = TypeVar("Function", bound=Callable[..., object])

PLAIN = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""Kernels are the functions that they were written as: for tests of the tests."""


_log = logging.getLogger(__name__)


def _load(names: Sequence[str]) -> None:
    from simplifier.kernels.compiled.library import load_files

    load_files(names)


def kernel(takes: str) -> Callable[[Function], Function]:
    """Compile ahead, release the interpreter's lock; ``takes`` are its arguments as text.

    ``error_model="numpy"`` drops the check for division by zero, which keeps loops vectorizable;
    kernels guard their own divisions.  ``fastmath`` stays off: the same input must give the same
    bytes on every machine, whatever the compiler does with the rest.
    """
    return partial(_decorated, takes=takes)


def inner_kernel(function: Function) -> Function:
    """For what only kernels call, with the types that they call it with."""
    return _decorated(function)


def inline_kernel(function: Function) -> Function:
    """As :func:`inner_kernel`, for small ones that have no call of their own in inner loops."""
    return _decorated(function, inline=True)


def _decorated(function: Function, takes: str = "", *, inline: bool = False) -> Function:
    return function if PLAIN else cast(Function, Kernel(function, takes, inline=inline))


class Kernel:
    """A function of machine code; ``takes`` is empty for one that only kernels call."""

    __name__: str

    inner_options: ClassVar[dict[str, bool]] = {"cache": True}
    """How numba compiles what kernels call."""

    strict = False
    """Whether arguments that do not fit are an error, as they are in tests; else numba compiles the
    kernel for them, since a run that takes longer is better than none."""

    def __init__(self, function: Callable[..., Any], takes: str, *, inline: bool) -> None:
        update_wrapper(self, function)
        self.function, self.takes, self.inline = function, takes, inline
        self.file = function.__module__.rpartition(".")[2]
        self._run: Callable[..., Any] = self._first
        if takes:
            waiting[self.file] = _load

    def __call__(self, *arguments: Any) -> Any:
        return self._run(*arguments)

    @cached_property
    def signature(self) -> Group:
        """Of one that says what it takes."""
        return parse_signature(self.takes)

    def dispatcher(self, **options: bool) -> Any:
        """The kernel as numba compiles it itself, for whatever types it is called with."""
        import numba

        # For the reason that loading.py gives; read when the first function is compiled.
        numba.config.USE_LLVMLITE_MEMORY_MANAGER = 1
        return numba.njit(nogil=True, error_model="numpy", forceinline=self.inline, **options)(
            self.function
        )

    @cached_property
    def compiled_by_numba(self) -> Any:
        """What numba calls where kernels call kernels."""
        return self.dispatcher(**self.inner_options)

    @property
    def _numba_type_(self) -> Any:
        """How numba sees it."""
        return self.compiled_by_numba._numba_type_

    def compile_by_numba(self) -> None:
        """For where machine code cannot be had ahead; numba keeps what it compiles."""
        from simplifier.kernels.compiled.numba_types import numba_types

        self.compiled_by_numba.compile(numba_types(self.signature))

    def run_machine_code(self, code: Callable[..., Any]) -> None:
        """From now on, call that."""
        fits = self.signature.fits

        def run(*arguments: Any) -> Any:
            if fits(arguments):
                return code(*arguments)
            what = f"{self.file}.{self.__name__}: {misfit(self.signature, arguments)}"
            if self.strict:
                raise TypeError(what)
            _log.warning("compiled once more, which takes a while: %s", what)
            return self.compiled_by_numba(*arguments)

        self._run = run

    def _first(self, *arguments: Any) -> Any:
        if self.takes:  # others are compiled by numba, with what they call
            load_imported()
        if self._run == self._first:  # there is no machine code
            self._run = self.compiled_by_numba
        return self._run(*arguments)
