"""A mutant put into the running process, and taken out of it.

The functions of a file keep their identity and get other code, so everyone who has imported them
by name has the mutant at once; constants are set in every module that has imported them.  Kernels
are such functions while numba's compiler is off.  What functions of the file remember of earlier
calls is forgotten, before and after.
"""

from __future__ import annotations

import ast
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import CodeType, FunctionType, ModuleType

from tests.mutants.operators import Mutant

_OURS = ("simplifier", "service", "tests")


def functions_of(path: str) -> list[FunctionType]:
    """All that live in this process and were defined in a file, those within functions too."""
    gc.unfreeze()  # what is frozen is not listed, and tests are once they are collected
    return [
        one
        for one in gc.get_objects()
        # By type: to ask a proxy of what is gone for its class is an error.
        if type(one) is FunctionType and one.__code__.co_filename == path
    ]


@contextmanager
def swapped(mutant: Mutant, module: ModuleType, functions: list[FunctionType]) -> Iterator[bool]:
    """The mutant stands in for its original; false where no such function has been defined."""
    _forget(module)
    try:
        with _put_in(mutant, module, functions) as changed:
            yield changed
    finally:
        _forget(module)


def _forget(module: ModuleType) -> None:
    for one in vars(module).values():
        if hasattr(one, "cache_clear"):
            one.cache_clear()


@contextmanager
def _put_in(mutant: Mutant, module: ModuleType, functions: list[FunctionType]) -> Iterator[bool]:
    if mutant.name is not None:
        with _constant(mutant, mutant.name, module):
            yield True
        return
    tree = ast.fix_missing_locations(mutant.module)
    codes = {_place(code): code for code in _codes_in(compile(tree, str(module.__file__), "exec"))}
    before = [(one, one.__code__) for one in functions]
    changed = False
    for function, code in before:
        new = codes.get(_place(code))
        if new is not None and new.co_freevars == code.co_freevars:
            function.__code__ = new
            changed = True
    try:
        yield changed
    finally:
        for function, code in before:
            function.__code__ = code


@contextmanager
def _constant(mutant: Mutant, name: str, module: ModuleType) -> Iterator[None]:
    old = getattr(module, name)
    namespace = dict(vars(module))
    statement = next(one for one in mutant.module.body if getattr(one, "lineno", 0) == mutant.line)
    alone = ast.fix_missing_locations(ast.Module([statement], []))
    exec(compile(alone, str(module.__file__), "exec"), namespace)
    holders = [
        other
        for key, other in list(sys.modules.items())
        if (other is module or key.partition(".")[0] in _OURS) and vars(other).get(name) is old
    ]
    for holder in holders:
        setattr(holder, name, namespace[name])
    try:
        yield
    finally:
        for holder in holders:
            setattr(holder, name, old)


def _codes_in(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from _codes_in(constant)


def _place(code: CodeType) -> tuple[str, int]:
    return code.co_qualname, code.co_firstlineno
