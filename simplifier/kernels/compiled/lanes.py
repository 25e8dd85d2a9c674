"""Vectors of numbers in LLVM's instructions: one number in all lanes, what lies at addresses, and
those of some lanes alone."""

from __future__ import annotations

from typing import Any

import llvmlite.ir as ir

BIT, CELL, WORD, NUMBER = ir.IntType(1), ir.IntType(32), ir.IntType(64), ir.DoubleType()


def constant(kind: Any, value: float) -> Any:
    """A vector of a number in all lanes."""
    return ir.Constant(kind, [value] * kind.count)


def flags_of(kind: Any) -> Any:
    """A bit for each lane of a vector."""
    return ir.VectorType(BIT, kind.count)


def spread(builder: Any, value: Any, kind: Any) -> Any:
    """A vector of a value of LLVM's in all lanes."""
    undefined = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(undefined, value, CELL(0))
    order = constant(ir.VectorType(CELL, kind.count), 0)
    return builder.shuffle_vector(first, undefined, order)


def word_of(builder: Any, flags: Any) -> Any:
    """A bit for each lane, in a uint64."""
    return builder.zext(builder.bitcast(flags, ir.IntType(flags.type.count)), WORD)


def loaded(builder: Any, kind: Any, address: Any) -> Any:
    """The vector at an address, of numbers of 32 bits."""
    return builder.load(builder.bitcast(address, kind.as_pointer()), align=4)


def gathered(
    builder: Any, kind: Any, address: Any, offsets: Any, flags: Any = None, align: int = 4
) -> Any:
    """What lies ``offsets`` bytes, a vector of uint64, behind an address; 0 where no flag is."""
    base = spread(builder, builder.ptrtoint(address, WORD), offsets.type)
    pointers = ir.VectorType(kind.element.as_pointer(), kind.count)
    places = builder.inttoptr(builder.add(base, offsets), pointers)
    some = constant(flags_of(kind), 1) if flags is None else flags
    otherwise = ir.Constant(kind, ir.Undefined) if flags is None else constant(kind, 0)
    name = f"masked.gather.{_letters(kind)}.v{kind.count}p0"
    return _call(builder, name, kind, places, CELL(align), some, otherwise)


def compressed(builder: Any, values: Any, flags: Any) -> Any:
    """Those of the lanes with a flag first, the others undefined."""
    undefined = ir.Constant(values.type, ir.Undefined)
    return call(builder, "experimental.vector.compress", values.type, values, flags, undefined)


def least(builder: Any, *values: Any) -> Any:
    """Of unsigned numbers, or of floating ones none of which is NaN, lane by lane."""
    return _chosen(builder, "<", values)


def greatest(builder: Any, *values: Any) -> Any:
    """As :func:`least`."""
    return _chosen(builder, ">", values)


def _chosen(builder: Any, order: str, values: Any) -> Any:
    found, *others = values
    compare = builder.fcmp_ordered if found.type.element == NUMBER else builder.icmp_unsigned
    for value in others:
        found = builder.select(compare(order, value, found), value, found)
    return found


def call(builder: Any, name: str, result: Any, vector: Any, *given: Any) -> Any:
    """One of LLVM's own functions of a vector."""
    return _call(builder, f"{name}.{_letters(vector.type)}", result, vector, *given)


def _call(builder: Any, name: str, result: Any, *given: Any) -> Any:
    kind = ir.FunctionType(result, [value.type for value in given])
    known = builder.module.globals.get(f"llvm.{name}")
    return builder.call(known or ir.Function(builder.module, kind, f"llvm.{name}"), given)


def _letters(kind: Any) -> str:
    letter, bits = ("f", 64) if kind.element == NUMBER else ("i", kind.element.width)
    return f"v{kind.count}{letter}{bits}"
