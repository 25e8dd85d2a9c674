"""Vectors of numbers in LLVM's instructions: one number in all lanes, what lies at addresses, and
those of some lanes alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.processors import Processor

BIT, CELL, WORD, NUMBER = ir.IntType(1), ir.IntType(32), ir.IntType(64), ir.DoubleType()

LANES = 8 if Processor.chosen().has_wide_registers else 4
"""Of the vectors that most is done with: of float64 they fill a register.  Of longer ones the
compiler packs and unpacks the flags of each register, which takes longer than what they tell."""

CELLS, WORDS, NUMBERS = (ir.VectorType(kind, LANES) for kind in (CELL, WORD, NUMBER))


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


def moved(builder: Any, one: Any, other: Any, order: Sequence[int]) -> Any:
    """The lanes of two vectors that an order names; those of the second come after the first's."""
    places = ir.Constant(ir.VectorType(CELL, len(order)), list(order))
    return builder.shuffle_vector(one, other, places)


def word_of(builder: Any, flags: Any) -> Any:
    """A bit for each lane, in a uint64."""
    return builder.zext(builder.bitcast(flags, ir.IntType(flags.type.count)), WORD)


def is_set(builder: Any, flags: Any) -> Any:
    """Whether any lane has its flag."""
    return builder.icmp_unsigned("!=", word_of(builder, flags), WORD(0))


def loaded(builder: Any, kind: Any, address: Any) -> Any:
    """The vector at an address, of numbers of 32 bits."""
    return builder.load(builder.bitcast(address, kind.as_pointer()), align=4)


def loaded_rows(
    builder: Any, kind: Any, listed: Any, begin: Any, stride: int, rows: int
) -> list[Any]:
    """The vectors at ``begin`` in as many lists of numbers of 32 bits, ``stride`` apart."""
    return [
        loaded(builder, kind, builder.gep(listed, [builder.add(begin, WORD(stride * row))]))
        for row in range(rows)
    ]


def gathered(
    builder: Any, kind: Any, address: Any, offsets: Any, flags: Any = None, align: int = 4
) -> Any:
    """What lies ``offsets`` bytes, a vector of uint64, behind an address; anything where there
    are flags, but no flag."""
    if flags is not None and not Processor.chosen().gathers:
        # The compiler loads lane by lane, and jumps over each without a flag.
        offsets = builder.select(flags, offsets, constant(offsets.type, 0))
        flags = None
    base = spread(builder, builder.ptrtoint(address, WORD), offsets.type)
    pointers = ir.VectorType(kind.element.as_pointer(), kind.count)
    places = builder.inttoptr(builder.add(base, offsets), pointers)
    some = constant(flags_of(kind), 1) if flags is None else flags
    otherwise = ir.Constant(kind, ir.Undefined)
    name = f"masked.gather.{_letters(kind)}.v{kind.count}p0"
    return _call(builder, name, kind, places, CELL(align), some, otherwise)


def append(
    builder: Any, rows: Sequence[Any], flags: Any, listed: Any, count: Any, stride: int = 0
) -> Any:
    """Write the lanes with a flag behind ``count`` others; the new count.

    ``rows`` are vectors of one kind; the list of the next one is ``stride`` numbers further on.  As
    many numbers as there are lanes are written at most, whatever the flags.
    """
    if Processor.chosen().has_wide_registers:
        append_some = _append_by_flags
    elif Processor.chosen().moves_bytes:
        append_some = _append_by_table
    else:
        append_some = _append_one_by_one
    return append_some(builder, rows, flags, listed, count, stride)


def _append_by_flags(
    builder: Any, rows: Sequence[Any], flags: Any, listed: Any, count: Any, stride: int
) -> Any:
    for row, values in enumerate(rows):
        place = builder.gep(listed, [builder.add(count, WORD(stride * row))])
        undefined = ir.Constant(values.type, ir.Undefined)
        name = "experimental.vector.compress"
        kept = call(builder, name, values.type, values, flags, undefined)
        builder.store(kept, builder.bitcast(place, values.type.as_pointer()), align=4)
    return builder.add(count, builder.ctpop(word_of(builder, flags)))


def _append_by_table(
    builder: Any, rows: Sequence[Any], flags: Any, listed: Any, count: Any, stride: int
) -> Any:
    """Four lanes of 32 bits at a time, by an instruction that moves bytes."""
    word, table = word_of(builder, flags), _moves(builder.module)
    for part in range(0, flags.type.count, 4):
        four = builder.and_(builder.lshr(word, WORD(part)), WORD(15))
        order = builder.load(builder.gep(table, [WORD(0), four]))
        for row, values in enumerate(rows):
            lanes = moved(builder, values, values, range(part, part + 4))
            some = builder.bitcast(lanes, _OCTETS)
            kept = _call(builder, "x86.ssse3.pshuf.b.128", _OCTETS, some, order)
            place = builder.gep(listed, [builder.add(count, WORD(stride * row))])
            builder.store(kept, builder.bitcast(place, _OCTETS.as_pointer()), align=4)
        count = builder.add(count, builder.ctpop(four))
    return count


_OCTETS = ir.VectorType(ir.IntType(8), 16)


def _moves(module: Any) -> Any:
    """A table: by the flags of four lanes, where each byte of those with one is to come from."""
    name = "moves_of_four_lanes"
    if name not in module.globals:
        orders = []
        for flags in range(16):
            lanes = [lane for lane in range(4) if flags >> lane & 1]
            octets = [4 * lane + octet for lane in lanes for octet in range(4)]
            orders.append(ir.Constant(_OCTETS, octets + [0] * (16 - len(octets))))
        table = ir.GlobalVariable(module, ir.ArrayType(_OCTETS, len(orders)), name)
        table.initializer = ir.Constant(table.value_type, orders)
        table.global_constant, table.linkage = True, "internal"
    return module.globals[name]


def _append_one_by_one(
    builder: Any, rows: Sequence[Any], flags: Any, listed: Any, count: Any, stride: int
) -> Any:
    """Where nothing moves lanes next to each other: what stands for it takes twice as long."""
    kind = rows[0].type
    with builder.goto_entry_block():
        scratch = builder.alloca(kind, size=len(rows))
    for row, values in enumerate(rows):
        builder.store(values, builder.gep(scratch, [WORD(row)]))
    numbers = builder.bitcast(scratch, kind.element.as_pointer())

    def copy(left: Any, count: Any) -> Sequence[Any]:
        lane = builder.cttz(left, BIT(1))
        for row in range(len(rows)):
            number = builder.load(builder.gep(numbers, [builder.add(lane, WORD(kind.count * row))]))
            builder.store(number, builder.gep(listed, [builder.add(count, WORD(stride * row))]))
        left = builder.and_(left, builder.sub(left, WORD(1)))
        return builder.icmp_unsigned("!=", left, WORD(0)), left, builder.add(count, WORD(1))

    return repeat(builder, is_set(builder, flags), [word_of(builder, flags), count], copy)[1]


def run_of_ones(builder: Any, first: Any, count: Any) -> Any:
    """As :func:`~..faces.run_of_ones`, of vectors of uint64; anything where there are none."""
    most = constant(first.type, 63)
    shift = builder.and_(builder.sub(constant(first.type, 64), count), most)
    return builder.shl(builder.lshr(constant(first.type, -1), shift), builder.and_(first, most))


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
