"""LLVM's instructions that draw a triangle into a bit image, and count it among others.

Loops over rows compile to more: numba asks of each index whether it counts from the end, and the
compiler of each pair of arrays whether they share memory, which takes as long as eight rows.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.lanes import NUMBER, WORD, call, constant, spread
from simplifier.kernels.compiled.rows import (
    ALL,
    EIGHT,
    NOTHING,
    ROWS,
    all_but_one,
    is_any,
    load_rows,
    place_of,
    store_rows,
)

_TRUE = ir.IntType(1)(1)
_NUMBERS = ir.VectorType(NUMBER, EIGHT)
_EXPONENT = 2.0**52  # a whole number below it is in the last bits of the sum
_RAISED_NOUGHT = constant(ROWS, struct.unpack("q", struct.pack("d", _EXPONENT))[0])


def write_draw(
    builder: Any, block: int, from_row: int, to_row: int, outlines: Any, view: Any, layers: Any,
    height: Any, own: Any, new: Any, eights: Any,
) -> Any:  # fmt: skip
    """As :func:`~..soup_views.draw_found` says.

    ``block`` views have a number of their outlines after the other; ``from_row`` and ``to_row`` are
    the numbers of the rows that matter.
    """

    def number(place: int) -> Any:
        return builder.load(builder.gep(outlines, [builder.add(view, WORD(place * block))]))

    outline = [spread(builder, number(place), _NUMBERS) for place in range(10)]
    first, end = (builder.fptosi(number(place), WORD) for place in (from_row, to_row))
    middles = ir.Constant(_NUMBERS, [row + 0.5 for row in range(EIGHT)])
    middles = builder.fadd(spread(builder, number(from_row), _NUMBERS), middles)
    twice = place_of(builder, layers, height)
    for begin in range(0, 64, EIGHT):
        store_rows(builder, NOTHING, place_of(builder, new, begin))

    def draw(row: Any, middle: Any, differs: Any, changed: Any) -> Sequence[Any]:
        bits = _bits(builder, outline, middle)
        store_rows(builder, bits, place_of(builder, new, row))
        here, once, more = (
            load_rows(builder, place_of(builder, image, row)) for image in (own, layers, twice)
        )
        union = builder.or_(all_but_one(builder, once, more, here), bits)
        moved = builder.zext(is_any(builder, builder.xor(bits, here)), WORD)
        following = builder.add(row, WORD(EIGHT))
        return (
            builder.icmp_signed("<", following, end),
            following,
            builder.fadd(middle, constant(_NUMBERS, float(EIGHT))),
            builder.or_(differs, builder.xor(union, once)),
            builder.or_(changed, builder.shl(moved, builder.lshr(row, WORD(3)))),
        )

    some = builder.icmp_signed("<", first, end)
    _, _, differs, changed = repeat(builder, some, [first, middles, NOTHING, WORD(0)], draw)
    builder.store(changed, eights)
    return call(builder, "vector.reduce.or", WORD, differs)


def _bits(builder: Any, outline: Any, middle: Any) -> Any:
    """As :func:`~..soup_views._outline_bits`, of several rows by their middles."""
    start, top, long, upper, middle_start, middle_top, lower, first, split, last = outline
    down = builder.fsub(middle, top)
    one = builder.fadd(start, builder.fmul(down, long))
    above = builder.fadd(start, builder.fmul(down, upper))
    below = builder.fmul(builder.fsub(middle, middle_top), lower)
    below = builder.fadd(middle_start, below)
    two = builder.select(builder.fcmp_ordered("<", middle, split), above, below)
    passes = builder.and_(
        builder.fcmp_ordered(">", middle, first), builder.fcmp_ordered("<", middle, last)
    )
    bits = builder.xor(_right_of(builder, one), _right_of(builder, two))
    return builder.select(passes, bits, NOTHING)


def _right_of(builder: Any, column: Any) -> Any:
    """The pixels of rows with their centre right of a column."""
    column = call(builder, "ceil", _NUMBERS, column)
    nought = constant(_NUMBERS, 0.0)
    column = builder.select(builder.fcmp_ordered(">", column, nought), column, nought)
    raised = builder.fadd(column, constant(_NUMBERS, _EXPONENT))
    shift = builder.xor(builder.bitcast(raised, ROWS), _RAISED_NOUGHT)
    inside = builder.fcmp_ordered("<", column, constant(_NUMBERS, 64.0))
    return builder.select(inside, builder.shl(ALL, shift), NOTHING)


def write_exchange(
    builder: Any, layers: Any, digits: Any, height: Any, old: Any, new: Any, eights: Any
) -> Any:
    """As :func:`~..soup_views.exchange_picture` says; 0."""
    lowest = builder.gep(layers, [builder.mul(height, WORD(2))])

    def exchange(left: Any) -> Sequence[Any]:
        row = builder.shl(builder.cttz(left, _TRUE), WORD(3))
        before, after = (load_rows(builder, place_of(builder, image, row)) for image in (old, new))
        store_rows(builder, after, place_of(builder, old, row))
        lost = builder.and_(before, builder.xor(after, ALL))
        digit = builder.gep(lowest, [row])

        def carry_on(place: Any, carry: Any) -> Sequence[Any]:
            was = load_rows(builder, place)
            store_rows(builder, builder.xor(was, carry), place)
            carried = builder.and_(carry, builder.xor(was, lost))
            return is_any(builder, carried), builder.gep(place, [height]), carried

        differs = builder.xor(before, after)
        repeat(builder, is_any(builder, differs), [digit, differs], carry_on)

        def add(count: Any, place: Any, several: Any) -> Sequence[Any]:
            following = builder.add(count, WORD(1))
            more = builder.or_(several, load_rows(builder, place))
            rest = builder.icmp_signed("<", following, digits)
            return rest, following, builder.gep(place, [height]), more

        second = builder.gep(digit, [height])
        _, _, several = repeat(builder, _TRUE, [WORD(1), second, NOTHING], add)
        union = builder.or_(load_rows(builder, digit), several)
        store_rows(builder, union, place_of(builder, layers, row))
        store_rows(builder, several, builder.gep(layers, [builder.add(height, row)]))
        rest = builder.and_(left, builder.sub(left, WORD(1)))
        return builder.icmp_unsigned("!=", rest, WORD(0)), rest

    repeat(builder, builder.icmp_unsigned("!=", eights, WORD(0)), [eights], exchange)
    return WORD(0)
