"""``for`` over a range, with two numbers in memory in place of four structures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba.core
import numba.cpython.rangeobj  # whose functions are in numba's registry from now on
from llvmlite.ir import Constant
from numba.core import cgutils, imputils

types: Any = numba.core.types

registry = imputils.Registry("ranges of kernels")


def _range(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """``range(stop)``, ``range(start, stop)`` or ``range(start, stop, step)`` of one type."""
    kind = signature.return_type.dtype
    start = () if len(arguments) > 1 else (context.get_constant(kind, 0),)
    step = () if len(arguments) > 2 else (context.get_constant(kind, 1),)
    return _of_parts(context, builder, signature, (*start, *arguments, *step))


def _start(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """An iterator: where the next number and how many are left lie, and what ends it."""
    start, stop, step = cgutils.unpack_tuple(builder, arguments[0], 3)
    if not (isinstance(step, Constant) and step.constant == 1):
        numbas = _numbas_start[signature.args[0]]
        return numbas(context, builder, signature, arguments)
    if isinstance(start, Constant) and start.constant == 0 and builder.is_natural(stop):
        count = stop
    else:
        zero, count = start.type(0), builder.sub(stop, start)
        count = builder.select(builder.icmp_signed(">", count, zero), count, zero)
    places = [cgutils.alloca_once(builder, value.type) for value in (start, count)]
    for value, place in zip((start, count), places, strict=True):
        builder.store(value, place)
    if builder.is_natural(start):
        builder.natural.add(places[0])
    return _of_parts(context, builder, signature, (places[0], stop, step, places[1]))


def _next(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The next number, and whether there was one."""
    place, _, step, counter = cgutils.unpack_tuple(builder, arguments[0], 4)
    left, value = builder.load(counter), builder.load(place)
    if place in builder.natural:
        builder.natural.add(value)
    builder.store(builder.sub(left, left.type(1)), counter)
    builder.store(builder.add(value, step), place)
    more = builder.icmp_signed(">", left, left.type(0))
    return _of_parts(context, builder, signature, (value, more))


def _of_parts(context: Any, builder: Any, signature: Any, parts: Sequence[Any]) -> Any:
    kind = context.get_value_type(signature.return_type)
    return cgutils.make_anonymous_struct(builder, parts, kind)


_numbas_start = {}
for _kind, _state, _iterator in (
    (types.int32, types.range_state32_type, types.range_iter32_type),
    (types.int64, types.range_state64_type, types.range_iter64_type),
    (types.uint64, types.unsigned_range_state64_type, types.unsigned_range_iter64_type),
):
    for _count in (1, 2, 3):
        registry.lower(range, *(_kind,) * _count)(_range)
    _numbas_start[_state] = next(
        function
        for function, name, taken in imputils.builtin_registry.functions
        if (name, taken) == ("getiter", (_state,))
    )
    registry.lower("getiter", _state)(_start)
    registry.lower("iternext", _iterator)(_next)
