"""Elements, rows and lengths of contiguous arrays, straight from their values."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from functools import reduce
from typing import Any

import numba.core
from llvmlite.ir import Constant
from numba.core import cgutils, imputils
from numba.np import arrayobj

types: Any = numba.core.types

registry = imputils.Registry("arrays of kernels")


def _get(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    place = _element(context, builder, signature.args[:2], arguments[:2])
    if place is not None:
        return arrayobj.load_item(context, builder, kind, place)
    if _names_row(signature):
        row = _row(context, builder, signature, arguments)
        return imputils.impl_ret_borrowed(context, builder, signature.return_type, row)
    by_tuple = isinstance(signature.args[1], types.BaseTuple)
    numbas = arrayobj.getitem_array_tuple if by_tuple else arrayobj.getitem_arraynd_intp
    return numbas(context, builder, signature, arguments)


def _set(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, _, given = signature.args
    place = _element(context, builder, signature.args[:2], arguments[:2])
    if place is None:
        return arrayobj.setitem_array(context, builder, signature, arguments)
    value = context.cast(builder, arguments[2], given, kind.dtype)
    return arrayobj.store_item(context, builder, kind, value, place)


for _kind in (types.Integer, types.BaseTuple):
    registry.lower(operator.getitem, types.Array, _kind)(_get)
    registry.lower(operator.setitem, types.Array, _kind, types.Any)(_set)


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
    offset = None
    for one, place, length in zip(
        index_kinds, indices, _lengths(context, builder, kind, array), strict=True
    ):
        step = _from_start(context, builder, one, place, length)
        if offset is None or (isinstance(offset, Constant) and offset.constant == 0):
            offset = step
        else:
            offset = builder.add(builder.mul(offset, length), step)
    return builder.gep(_part(context, builder, kind, array, "data"), [offset])


def _from_start(context: Any, builder: Any, kind: Any, index: Any, length: Any) -> Any:
    """An index counted from the start, without a look at what is known to be so."""
    if builder.is_natural(index):
        return context.cast(builder, index, kind, types.intp)
    key = builder.block, index, length
    if key not in builder.fixed:
        builder.fixed[key] = arrayobj.fix_integer_index(context, builder, kind, index, length)
    return builder.fixed[key]


def _names_row(signature: Any) -> bool:
    """Whether one integer indexes a contiguous array of more dimensions."""
    kind, index_kind = signature.args
    row = signature.return_type
    return (
        isinstance(index_kind, types.Integer)
        and isinstance(row, types.Array)
        and kind.layout == row.layout == "C"
        and kind.ndim == row.ndim + 1
    )


def _row(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    (kind, index_kind), (array, index) = signature.args, arguments

    def part(name: str) -> Any:
        return _part(context, builder, kind, array, name)

    first, *lengths = _lengths(context, builder, kind, array)
    strides = cgutils.unpack_tuple(builder, part("strides"), kind.ndim)
    count = reduce(builder.mul, lengths)
    offset = builder.mul(_from_start(context, builder, index_kind, index, first), count)
    parts = {
        "meminfo": part("meminfo"),
        "parent": part("parent"),
        "nitems": count,
        "itemsize": part("itemsize"),
        "data": builder.gep(part("data"), [offset]),
        "shape": _integers(context, builder, lengths),
        "strides": _integers(context, builder, strides[1:]),
    }
    names = context.data_model_manager[signature.return_type]._fields
    return cgutils.make_anonymous_struct(
        builder, [parts[name] for name in names], context.get_value_type(signature.return_type)
    )


@registry.lower(len, types.Array)
def _length(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _lengths(context, builder, signature.args[0], arguments[0])[0]


@registry.lower_getattr(types.Array, "shape")
def _shape(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return _integers(context, builder, _lengths(context, builder, kind, array))


def _lengths(context: Any, builder: Any, kind: Any, array: Any) -> list[Any]:
    lengths: list[Any] = cgutils.unpack_tuple(
        builder, _part(context, builder, kind, array, "shape"), kind.ndim
    )
    builder.natural.update(lengths)
    return lengths


def _part(context: Any, builder: Any, kind: Any, array: Any, name: str) -> Any:
    return context.data_model_manager[kind].get(builder, array, name)


def _integers(context: Any, builder: Any, values: Sequence[Any]) -> Any:
    return cgutils.pack_array(builder, values, context.get_value_type(types.intp))
