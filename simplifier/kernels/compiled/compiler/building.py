"""Kernel files to machine code: a process of its own, which reads names and answers with each.

numba compiles function by function, each with a copy of all that it calls, optimized and made into
machine code again and again.  Here it only types and lowers; what a kernel file and all that it
calls became is put together, optimized once, and written as one object file.  That takes half the
time.  What kernels return is the same: nothing here lets the compiler reorder arithmetic.

The process changes parts of numba that are not meant for it, which is why it is one of its own, and
why callers go on with numba alone where it fails.
"""

from __future__ import annotations

import gc
import importlib
import json
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba.core import codegen
from numba.core.registry import cpu_target

from simplifier.kernels.compiled.code_files import write_code
from simplifier.kernels.compiled.compiler.front_end import look_less
from simplifier.kernels.compiled.compiler.lowering import LeanContext, lower_less
from simplifier.kernels.compiled.kernel import Kernel
from simplifier.kernels.compiled.loading import ENVIRONMENT, UNPICKLE, packed
from simplifier.kernels.compiled.numba_types import numba_types
from simplifier.kernels.compiled.processors import Processor

_PACKAGE = "simplifier.kernels"


class _Code(codegen.AOTCodeLibrary):  # type: ignore[misc]
    """What one function was lowered to, as it is: it is optimized with all others of a file."""

    _empty = True

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def add_llvm_module(self, ll_module: Any) -> None:
        if self._empty:
            self._optimize_functions(ll_module)
            self._final_module, self._empty = ll_module, False
        else:
            super().add_llvm_module(ll_module)

    def finalize(self) -> None:
        self._finalized = True


class _Codegen(codegen.AOTCPUCodegen):  # type: ignore[misc]
    """For the processor that is chosen, with all that it has."""

    _library_class = _Code

    def _customize_tm_features(self) -> str:
        return Processor.chosen().features


class _Context(LeanContext):
    """Nothing is run in this process, so nothing is made ready to run."""

    def create_cfunc_wrapper(self, *arguments: Any, **named: Any) -> None:
        pass

    def get_executable(self, *arguments: Any) -> Any:
        return [].append  # numba asks for a built-in function, another one each time


def _only_lower() -> Any:
    """From now on, whatever numba compiles in this process is lowered and no more."""
    context = _Context(cpu_target.typing_context, "cpu")
    context = context.subtarget(
        _internal_codegen=_Codegen("kernels", Processor.chosen().name), aot_mode=True
    )
    look_less()
    lower_less()
    vars(cpu_target)["_toplevel_target_context"] = context
    # Python never calls what only kernels call.
    Kernel.inner_options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return context


def compile_file(name: str, context: Any) -> bytes:
    """The kernels in a file that say what they take, as :func:`load_code` takes them."""
    kernels = [one for one in vars(importlib.import_module(f"{_PACKAGE}.{name}")).values()
               if isinstance(one, Kernel) and one.file == name and one.takes]  # fmt: skip
    found = {one.__name__: _lowered(one) for one in kernels}
    module = llvm.parse_assembly(str(context.codegen()._create_empty_module(name)))
    module.data_layout = context.codegen()._data_layout
    for library in _with_all_called([one.library for one in found.values()]):
        module.link_in(library._final_module, preserve=True)
    wanted = {
        symbol: new
        for called, one in found.items()
        for symbol, new in (
            (one.fndesc.llvm_cpython_wrapper_name, f"{name}.{called}"),
            (one.fndesc.env_name, f"{name}.{called}{ENVIRONMENT}"),
        )
    }
    for one in (*module.functions, *module.global_variables):
        if one.is_declaration:
            if one.name == "numba_unpickle":
                one.name = UNPICKLE
        elif one.name in wanted:
            one.linkage, one.name = "external", wanted[one.name]
        else:
            one.linkage = "internal"
    _optimize(module, context.codegen())
    constants = {called: [str(one) for one in result.environment.consts]
                 for called, result in found.items()}  # fmt: skip
    return packed(bytes(context.codegen()._tm.emit_object(module)), constants)


def _lowered(kernel: Kernel) -> Any:
    """What numba makes of a kernel: a CompileResult."""
    dispatcher = kernel.dispatcher(no_cfunc_wrapper=True)
    arguments = numba_types(kernel.signature)
    dispatcher.compile(arguments)
    result = dispatcher.overloads[arguments]
    if not all(isinstance(one, np.dtype) for one in result.environment.consts):
        raise ValueError(f"{kernel.__name__} needs objects of Python that are not kept")
    return result


def _with_all_called(libraries: Sequence[Any]) -> Iterator[Any]:
    """Each library once, those that call others first: only what is called is linked."""
    seen, waiting = set(), list(libraries)
    while waiting:
        library = waiting.pop(0)
        if id(library) not in seen:
            seen.add(id(library))
            yield library
            waiting += library._linking_libraries


def _optimize(module: Any, maker: Any) -> None:
    """The passes that numba runs on a function, over all of them at once."""
    cheap, builder = maker._module_pass_manager(
        loop_vectorize=maker._loopvect, slp_vectorize=False, opt=maker._opt_level, cost="cheap"
    )
    cheap.run(module, builder)
    full, builder = maker._module_pass_manager()
    full.run(module, builder)


def main(folder: str) -> None:
    """Read a name a line from standard input; write its machine code and answer with the name."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who has started it ends it
    gc.disable()  # types and trees stay until the end, and looking through them takes a tenth
    context = _only_lower()
    for line in sys.stdin:
        name = line.strip()
        write_code(Path(folder), name, compile_file(name, context))
        print(name, flush=True)


if __name__ == "__main__":
    main(*json.loads(sys.argv[1]))
