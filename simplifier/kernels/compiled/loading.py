"""Machine code to functions, without numba: importing that takes longer than most starts.

The code is an object file as llvmlite's linker takes it.  It calls what numba's extension modules
export (allocation, conversion of arrays, errors), which are therefore loaded by their files.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import json
import pickle
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite.binding as llvm
import numpy as np

ENVIRONMENT = ".environment"
"""What follows a function's symbol in that of the pointer to its numba environment."""


UNPICKLE = "occluder_unpickle"
"""What stands for numba's function of that purpose, which imports numba."""


@ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
def _unpickle(data: int, size: int, digest: int) -> object:
    """The object that machine code holds pickled: the class of an error, or that of arrays."""
    return _object_at(data, size)


@cache
def _object_at(data: int, size: int) -> object:
    return pickle.loads(ctypes.string_at(data, size))


def packed(code: bytes, constants: Mapping[str, Sequence[str]]) -> bytes:
    """An object file as it is kept: behind a line with its digest and what its functions refer to.

    ``constants`` are names of dtypes, those of the arrays that a function returns.
    """
    head = {"sha256": hashlib.sha256(code).hexdigest(), "constants": constants}
    return json.dumps(head).encode() + b"\n" + code


def load_code(path: Path, names: Sequence[str]) -> dict[str, Callable[..., Any]]:
    """The functions of those names in a file of machine code, whose symbols begin with the file's.

    They take what the kernels take and look at nothing of it.  Raises OSError for a file that
    cannot be read, ValueError for one that is damaged.
    """
    engine, dynfunc = _engine(), _extension("_dynfunc")
    line, _, code = path.read_bytes().partition(b"\n")
    head = json.loads(line)
    if hashlib.sha256(code).hexdigest() != head["sha256"]:
        raise ValueError(f"{path} is damaged; remove it")  # the linker would end the process
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    file, found = path.name.partition(".")[0], {}
    for name in names:
        address = engine.get_function_address(f"{file}.{name}")
        environment = dynfunc.Environment({})
        environment.consts.extend(np.dtype(one) for one in head["constants"][name])
        pointer = engine.get_global_value_address(f"{file}.{name}{ENVIRONMENT}")
        ctypes.c_void_p.from_address(pointer).value = id(environment)
        # What the code calls has to live as long as the function, also where some host takes this
        # module out of sys.modules, as Blender does with those of an add-on that it reloads.
        found[name] = dynfunc.make_function(
            sys.modules[__name__], name, "machine code of a kernel", address, environment,
            (engine, _unpickle),
        )  # fmt: skip
        _kept.append(environment)
    return found


_kept: list[Any] = []
"""The code refers to them for as long as the process lives."""


@cache
def _engine() -> Any:
    """The one linker of this process, which knows whatever machine code may call."""
    helpers, runtime = _extension("_helperlib"), _extension("_nrt_python", "core", "runtime")
    for name, address in helpers.c_helpers.items():
        llvm.add_symbol(f"numba_{name}", address)
    for name, address in runtime.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
    llvm.add_symbol("_Py_NoneStruct", id(None))
    llvm.add_symbol(UNPICKLE, ctypes.cast(_unpickle, ctypes.c_void_p).value)
    for error in (RuntimeError, TypeError, ValueError, MemoryError, IndexError, OverflowError,
                  ZeroDivisionError, SystemError):  # fmt: skip
        llvm.add_symbol(f"PyExc_{error.__name__}", id(error))
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    # Sections of a file refer to one another within 2 GiB.  Left alone LLVM puts each where there
    # is room, which beside the driver of a graphics card is further apart, and ends the process.
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine, use_lmm=True)


@cache
def _extension(name: str, *folders: str) -> ModuleType:
    """An extension module of numba, by its file."""
    package = importlib.util.find_spec("numba")
    if package is None or not package.submodule_search_locations:
        raise ImportError("numba is not installed")
    place = Path(package.submodule_search_locations[0], *folders)
    for suffix in EXTENSION_SUFFIXES:
        path = place / f"{name}{suffix}"
        if path.exists():
            full = ".".join(("numba", *folders, name))
            spec = importlib.util.spec_from_file_location(
                full, path, loader=ExtensionFileLoader(full, str(path))
            )
            assert spec is not None
            assert spec.loader is not None
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            return module
    raise ImportError(f"numba has no {name} in {place}")
