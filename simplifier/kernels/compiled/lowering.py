"""What numba makes of a kernel, with less of it: the same function in fewer instructions.

Most of the time of compiling goes into instructions that numba writes, LLVM reads, and the
optimizer takes out again.  Here they are not written:

- what a function is given is not counted, since its caller has it until the function ends;
- references in other values are counted without taking the rest of them apart;
- a number is not loaded before its variable is overwritten, nor its variable cleared at the end;
- an element of a contiguous array is addressed straight from the value of the array;
- a function that kernels call is compiled for ``int64`` where a caller gives a constant or a
  narrower integer, and not once more for each.

None of this changes a result: numbers are the same, and so is the order of what is done with them.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from typing import Any

import numba.core
from numba.core import cgutils, imputils, ir
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher
from numba.core.lowering import Lower
from numba.core.runtime.context import NRTContext
from numba.core.typed_passes import NativeLowering
from numba.core.types import Function
from numba.extending import overload
from numba.np import arrayobj

types: Any = numba.core.types

_PACKAGE = "simplifier.kernels"
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
        self.install_registry(_registry)
        self._registries_loaded = True

    def has_references(self, kind: Any) -> bool:
        """Whether there is a count of references anywhere in a value of that type."""
        if kind not in self.counted:
            self.counted[kind] = self.data_model_manager[kind].contains_nrt_meminfo()
        return self.counted[kind]


class _References(NRTContext):  # type: ignore[misc]
    def get_meminfos(self, builder: Any, ty: Any, val: Any) -> list[tuple[Any, Any]]:
        if not self._context.has_references(ty):
            return []
        model = self._context.data_model_manager[ty]
        found = [(ty, model.get_nrt_meminfo(builder, val))] if model.has_nrt_meminfo() else []
        for kind, part in model.traverse(builder):
            if self._context.has_references(kind):
                found += self.get_meminfos(builder, kind, part(val))
        return found


class _Lower(Lower):  # type: ignore[misc]
    def extract_function_arguments(self) -> Any:
        """Arguments whose arrays have no counter; so neither have their rows and slices.

        Counting is atomic, and both threads of a search count the same arrays: it took a third of
        the time of a search.  Where a function returns arrays, they may be what it was given.
        """
        values = super().extract_function_arguments()
        if not self.context.has_references(self.fndesc.restype):
            kinds = self.fndesc.argtypes
            self.fnargs = [self._lent(*one) for one in zip(kinds, values, strict=True)]
        return self.fnargs

    def _lent(self, kind: Any, value: Any) -> Any:
        if isinstance(kind, types.Array):
            model = self.context.data_model_manager[kind]
            nothing = model.get(self.builder, value, "meminfo").type(None)
            return model.set(self.builder, value, nothing, "meminfo")
        if isinstance(kind, types.BaseTuple):
            for place, part in enumerate(kind):
                lent = self._lent(part, self.builder.extract_value(value, place))
                value = self.builder.insert_value(value, lent, place)
        return value

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        kind = self.typeof(name)
        if argidx is None and not self.context.has_references(kind):
            self._alloca_var(name, kind)
            if name not in self._singly_assigned_vars:
                self.builder.store(value, self.getvar(name))
                return
        super().storevar(value, name, argidx)

    def alloca_lltype(self, name: str, lltype: Any, datamodel: Any = None) -> Any:
        """Without asking for its size, which is for debuggers."""
        return cgutils.alloca_once(self.builder, lltype, name=name)

    def delvar(self, name: str) -> None:
        if self.context.has_references(self.typeof(name)):
            super().delvar(name)
        elif name not in self._blk_local_varmap:
            self._singly_assigned_vars.discard(name)


def _get_element(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    place = _element(context, builder, signature.args[:2], arguments[:2])
    if place is None:
        numbas = _numbas_getitem(signature.args[1])
        return numbas(context, builder, signature, arguments)
    return arrayobj.load_item(context, builder, kind, place)


def _set_element(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, _, given = signature.args
    place = _element(context, builder, signature.args[:2], arguments[:2])
    if place is None:
        return arrayobj.setitem_array(context, builder, signature, arguments)
    value = context.cast(builder, arguments[2], given, kind.dtype)
    return arrayobj.store_item(context, builder, kind, value, place)


def _numbas_getitem(index: Any) -> Any:
    if isinstance(index, types.BaseTuple):
        return arrayobj.getitem_array_tuple
    return arrayobj.getitem_arraynd_intp


def _element(context: Any, builder: Any, kinds: Sequence[Any], values: Sequence[Any]) -> Any:
    """Where an element lies; None if the indices name no single one, or it takes strides."""
    (kind, index_kind), (array, index) = kinds, values
    index_kinds, indices = (index_kind,), (index,)
    if isinstance(index_kind, types.BaseTuple):
        index_kinds = tuple(index_kind)
        indices = cgutils.unpack_tuple(builder, index, len(index_kinds))
    if (
        kind.layout != "C"
        or len(indices) != kind.ndim
        or not all(isinstance(one, types.Integer) for one in index_kinds)
    ):
        return None
    model = context.data_model_manager[kind]
    shape = cgutils.unpack_tuple(builder, model.get(builder, array, "shape"), kind.ndim)
    offset = None
    for one, place, length in zip(index_kinds, indices, shape, strict=True):
        step = arrayobj.fix_integer_index(context, builder, one, place, length)
        offset = step if offset is None else builder.add(builder.mul(offset, length), step)
    return builder.gep(model.get(builder, array, "data"), [offset])


for _index in (types.Integer, types.BaseTuple):
    _registry.lower(operator.getitem, types.Array, _index)(_get_element)
    _registry.lower(operator.setitem, types.Array, _index, types.Any)(_set_element)


def _call_template(self: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """In place of numba's: of which types a kernel is compiled that another one calls."""
    if self.py_func.__module__.startswith(_PACKAGE):
        given = tuple(map(_common, given))
    return _numbas_call_template(self, given, named)


_numbas_call_template = Dispatcher.get_call_template


def _common(kind: Any) -> Any:
    """The type for which a kernel is compiled that is given that one.

    A constant that is true or false stays one, since branches hang on it.  So do integers of 8 and
    16 bits: beside a float32 they give another float32, where those of 32 and 64 give a float64.
    """
    if isinstance(kind, types.Integer) and kind.signed and kind.bitwidth >= 32:
        return types.int64
    return kind


def _call_type(self: Any, context: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """In place of numba's, which tries template after template at every call."""
    key = self.typing_key, self.templates, given
    if named or key not in _resolved:
        found = _numbas_call_type(self, context, given, named)
        if not named:
            _resolved[key] = found, self.get_impl_key(found)
        return found
    found, implementation = _resolved[key]
    self._impl_keys[found.args] = implementation
    return found


_numbas_call_type = Function.get_call_type
_resolved: dict[Any, tuple[Any, Any]] = {}


def _refuse_shapes(given: Any, wanted: Any) -> None:
    """In place of numba's, whose text of the two shapes takes sixty functions of strings."""


@overload(_refuse_shapes)
def _refusing(given: Any, wanted: Any) -> Any:
    def refuse(given: Any, wanted: Any) -> None:
        raise ValueError("cannot assign an array of another shape")

    return refuse


def _variables_of(statement: Any) -> list[Any]:
    """In place of numba's, which asks of each part of a statement in a call of its own."""
    return _variables_in(vars(statement).values())


def _variables_of_expression(expression: Any) -> list[Any]:
    return _variables_in(expression._kws.values())


def _variables_in(parts: Iterable[Any]) -> list[Any]:
    """Those that are read or written, in numba's order."""
    found = []
    for part in parts:
        if isinstance(part, ir.Var):
            found.append(part)
        elif isinstance(part, ir.Inst):
            found += part.list_vars()
        elif isinstance(part, (list, tuple)):
            found += _variables_in(part)
        elif isinstance(part, dict):
            found += _variables_in(part.values())
    return found


def lower_less() -> None:
    """From now on, this process compiles so."""
    for place, name, ours in (
        (arrayobj, "raise_with_shape_context", _refuse_shapes),
        (NativeLowering, "lowering_class", _Lower),
        (Dispatcher, "get_call_template", _call_template),
        (Function, "get_call_type", _call_type),
        (ir.Stmt, "list_vars", _variables_of),
        (ir.Expr, "list_vars", _variables_of_expression),
    ):
        setattr(place, name, ours)
