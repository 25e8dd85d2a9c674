"""What numba makes of a kernel, with less of it: the same function in fewer instructions.

Most of the time of compiling goes into instructions that numba writes, LLVM reads, and the
optimizer takes out again.  Here they are not written:

- what a function is given is not counted, since its caller has it until the function ends;
- references in other values are counted without taking the rest of them apart;
- a variable that stands for one value is that value, and lies in no memory (``variables.py``);
- elements and rows of contiguous arrays are addressed straight from the value of the array
  (``arrays.py``), with parts of values taken from where they were put in (``builder.py``);
- ranges are two numbers (``ranges.py``);
- a call hands on where errors are told, and looks at its code for one.

None of this changes a result: numbers are the same, and so is the order of what is done with them.
"""

from __future__ import annotations

import operator
from typing import Any

import numba.core
from llvmlite.ir import Constant
from numba.core import base, cgutils, imputils, ir
from numba.core.cpu import CPUContext
from numba.core.lowering import Lower
from numba.core.runtime.context import NRTContext
from numba.core.typed_passes import NativeLowering
from numba.cpython import numbers
from numba.extending import overload
from numba.np import arrayobj

from simplifier.kernels.compiled.compiler import arrays, ranges
from simplifier.kernels.compiled.compiler.builder import LeanBuilder
from simplifier.kernels.compiled.compiler.variables import single_values

types: Any = numba.core.types

_registry = imputils.Registry("kernels")


class LeanContext(CPUContext):  # type: ignore[misc]
    """How values of numba's types become LLVM's."""

    _registries_loaded = False

    def init(self) -> None:
        super().init()
        self.counted: dict[Any, bool] = {}

    @property
    def nrt(self) -> Any:
        return _References(self, self.enable_nrt)

    def load_additional_registries(self) -> None:
        """Import them once, and take what is new in them; numba does both for every function."""
        if self._registries_loaded:
            for registry in tuple(self._registries):
                self.install_registry(registry)
            return
        super().load_additional_registries()
        # What is installed last is taken, of functions for the same types.
        for registry in (
            imputils.builtin_registry,
            arrays.registry,
            ranges.registry,
            _registry,
        ):
            self.install_registry(registry)
        self._registries_loaded = True

    def has_references(self, kind: Any) -> bool:
        """Whether there is a count of references anywhere in a value of that type."""
        if kind not in self.counted:
            self.counted[kind] = self.data_model_manager[kind].contains_nrt_meminfo()
        return self.counted[kind]

    def pair_first(self, builder: Any, value: Any, kind: Any) -> Any:
        return builder.extract_value(value, 0)

    def pair_second(self, builder: Any, value: Any, kind: Any) -> Any:
        return builder.extract_value(value, 1)

    def call_internal(self, builder: Any, description: Any, signature: Any, given: Any) -> Any:
        """Call a function, and end as it did where it failed.

        It tells of an error where this one would; numba keeps what it tells, and tells it again.
        """
        kind = signature.return_type
        if isinstance(kind, types.Optional):
            return super().call_internal(builder, description, signature, given)
        convention = self.call_conv
        called = self.declare_function(builder.module, description)
        result = cgutils.alloca_once(builder, convention.get_return_type(kind).pointee)
        error = convention._get_excinfo_argument(builder.function)
        given = convention._get_arg_packer(signature.args).as_arguments(builder, given)
        code = builder.call(called, (result, error, *given))
        with cgutils.if_unlikely(builder, builder.icmp_signed("!=", code, code.type(0))):
            builder.ret(code)
        return self.get_returned_value(builder, kind, builder.load(result))

    def get_returned_value(self, builder: Any, kind: Any, value: Any) -> Any:
        if self._returns_as_is(kind):
            return value
        return super().get_returned_value(builder, kind, value)

    def get_return_value(self, builder: Any, kind: Any, value: Any) -> Any:
        return (
            value if self._returns_as_is(kind) else super().get_return_value(builder, kind, value)
        )

    def _returns_as_is(self, kind: Any) -> bool:
        """Whether a value is returned as it is, and need not be taken apart."""
        model = self.data_model_manager[kind]
        return bool(model.get_return_type() == model.get_value_type())


class _References(NRTContext):  # type: ignore[misc]
    def get_meminfos(self, builder: Any, ty: Any, val: Any) -> list[tuple[Any, Any]]:
        if not self._context.has_references(ty):
            return []
        model = self._context.data_model_manager[ty]
        found = []
        if model.has_nrt_meminfo():
            counter = model.get_nrt_meminfo(builder, val)
            if not (isinstance(counter, Constant) and counter.constant is None):
                found.append((ty, counter))
        for kind, part in model.traverse(builder):
            if self._context.has_references(kind):
                found += self.get_meminfos(builder, kind, part(val))
        return found


class _Lower(Lower):  # type: ignore[misc]
    def _find_singly_assigned_variable(self) -> None:
        """Beside numba's own, which one block alone assigns and reads."""
        super()._find_singly_assigned_variable()
        self._single, self._lent = set[str](), set[str]()
        if self.func_ir.is_generator:
            return
        blocks = self.func_ir.blocks
        if not self.context.has_references(self.fndesc.restype):
            self._lent = {
                statement.target.name
                for block in blocks.values()
                for statement in block.body
                if isinstance(statement, ir.Assign) and self._is_given(statement)
            }
        self._single = single_values(
            blocks,
            lambda name: name not in self._lent and self.context.has_references(self.typeof(name)),
        )
        self._lent &= self._single
        self._singly_assigned_vars |= self._single

    def _is_given(self, statement: Any) -> bool:
        """Whether a variable is what the function was given, as it is."""
        return isinstance(statement.value, ir.Arg) and bool(
            self.typeof(statement.target.name) == self.typeof(f"arg.{statement.value.name}")
        )

    def extract_function_arguments(self) -> Any:
        """Arguments whose arrays have no counter; so neither have their rows and slices.

        Counting is atomic, and both threads of a search count the same arrays: it took a third of
        the time of a search.  Where a function returns arrays, they may be what it was given.
        """
        values = super().extract_function_arguments()
        if not self.context.has_references(self.fndesc.restype):
            kinds = self.fndesc.argtypes
            self.fnargs = [self._uncounted(*one) for one in zip(kinds, values, strict=True)]
        return self.fnargs

    def _uncounted(self, kind: Any, value: Any) -> Any:
        if isinstance(kind, types.Array):
            model = self.context.data_model_manager[kind]
            nothing = model.get(self.builder, value, "meminfo").type(None)
            return model.set(self.builder, value, nothing, "meminfo")
        if isinstance(kind, types.BaseTuple):
            for place, part in enumerate(kind):
                lent = self._uncounted(part, self.builder.extract_value(value, place))
                value = self.builder.insert_value(value, lent, place)
        return value

    def lower_assign(self, kind: Any, statement: Any) -> Any:
        if statement.target.name in self._lent:
            return self.fnargs[statement.value.index]
        if isinstance(kind, types.Dispatcher):  # its type tells which
            return Constant(self.context.get_value_type(kind), None)
        return super().lower_assign(kind, statement)

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        kind = self.typeof(name)
        if name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        elif argidx is None and not self.context.has_references(kind):
            self._alloca_var(name, kind)
            self.builder.store(value, self.getvar(name))
        else:
            super().storevar(value, name, argidx)

    def alloca_lltype(self, name: str, lltype: Any, datamodel: Any = None) -> Any:
        """Without asking for its size, which is for debuggers."""
        return cgutils.alloca_once(self.builder, lltype, name=name)

    def delvar(self, name: str) -> None:
        kind = self.typeof(name)
        if name in self._lent or not self.context.has_references(kind):
            if name not in self._single and name not in self._blk_local_varmap:
                self._singly_assigned_vars.discard(name)
        elif name in self._single:
            self.decref(kind, self._blk_local_varmap[name])
        else:
            super().delvar(name)


def _calling(description: Any, libraries: Any) -> Any:
    """In place of ``user_function``: how a function is called that was compiled here."""

    def call(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return context.call_internal(builder, description, signature, given)

    call.signature, call.libs = description.argtypes, tuple(libraries)  # type: ignore[attr-defined]
    return call


def _divide(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    if context.error_model.raise_on_fp_zero_division:
        return numbers.real_div_impl(context, builder, signature, arguments)
    return builder.fdiv(*arguments)


for _kind in (types.float32, types.float64):
    for _operator in (operator.truediv, operator.itruediv):
        _registry.lower(_operator, _kind, _kind)(_divide)


def _refuse_shapes(given: Any, wanted: Any) -> None:
    """In place of numba's, whose text of the two shapes takes sixty functions of strings."""


@overload(_refuse_shapes)
def _refusing(given: Any, wanted: Any) -> Any:
    def refuse(given: Any, wanted: Any) -> None:
        raise ValueError("cannot assign an array of another shape")

    return refuse


def lower_less() -> None:
    """From now on, this process lowers so."""
    for place, name, ours in (
        (arrayobj, "raise_with_shape_context", _refuse_shapes),
        (NativeLowering, "lowering_class", _Lower),
        (base, "user_function", _calling),
        (numba.core.lowering, "IRBuilder", LeanBuilder),
    ):
        setattr(place, name, ours)
