"""LLVM's instructions that draw a triangle into a bit image, and count it among others.

Loops over rows compile to more: numba asks of each index whether it counts from the end, and the
compiler of each pair of arrays whether they share memory, which takes as long as eight rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.lanes import LANES, NUMBERS, WORD, call, constant, spread
from simplifier.kernels.compiled.rows import (
    ALL,
    NOTHING,
    ROWS,
    all_but_one,
    is_any,
    load_rows,
    place_of,
    store_rows,
)

_TRUE = ir.IntType(1)(1)
_IN_A_WORD = constant(ROWS, 63)
_EXPONENT = 2.0**52  # a whole number below it is in the last bits of the sum


def write_draw(
    builder: Any, block: int, edges: Any, view: Any, layers: Any, height: Any, own: Any, new: Any,
    eights: Any,
) -> Any:  # fmt: skip
    """As :func:`~..soup_views.draw_found` says; ``block`` views have a number after the other."""

    def number(place: int) -> Any:
        return builder.load(builder.gep(edges, [builder.add(view, WORD(place * block))]))

    outlines = [
        [spread(builder, number(5 * edge + which), NUMBERS) for which in range(5)]
        for edge in range(3)
    ]
    first, end = (builder.fptosi(number(place), WORD) for place in (15, 16))
    middles = ir.Constant(NUMBERS, [row + 0.5 for row in range(LANES)])
    middles = builder.fadd(spread(builder, number(15), NUMBERS), middles)
    twice = place_of(builder, layers, height)
    for begin in range(0, 64, LANES):
        store_rows(builder, NOTHING, place_of(builder, new, begin))

    def draw(row: Any, middle: Any, differs: Any, changed: Any) -> Sequence[Any]:
        bits = NOTHING
        for outline in outlines:
            bits = builder.xor(bits, _right_of(builder, outline, middle))
        store_rows(builder, bits, place_of(builder, new, row))
        here, once, more = (
            load_rows(builder, place_of(builder, image, row)) for image in (own, layers, twice)
        )
        union = builder.or_(all_but_one(builder, once, more, here), bits)
        moved = builder.zext(is_any(builder, builder.xor(bits, here)), WORD)
        following = builder.add(row, WORD(LANES))
        return (
            builder.icmp_signed("<", following, end),
            following,
            builder.fadd(middle, constant(NUMBERS, float(LANES))),
            builder.or_(differs, builder.xor(union, once)),
            builder.or_(changed, builder.shl(moved, builder.lshr(row, WORD(3)))),
        )

    some = builder.icmp_signed("<", first, end)
    _, _, differs, changed = repeat(builder, some, [first, middles, NOTHING, WORD(0)], draw)
    builder.store(changed, eights)
    return call(builder, "vector.reduce.or", WORD, differs)


def _right_of(builder: Any, edge: Any, middle: Any) -> Any:
    """As :func:`~..bit_image.edge_bits`, of eight rows by their middles."""
    start, top, slope, first, last = edge
    column = builder.fadd(start, builder.fmul(builder.fsub(middle, top), slope))
    column = call(builder, "ceil", NUMBERS, column)
    nought = constant(NUMBERS, 0.0)
    passes = builder.and_(
        builder.fcmp_ordered(">", middle, first),
        builder.and_(
            builder.fcmp_ordered("<", middle, last),
            builder.fcmp_ordered("<", column, constant(NUMBERS, 64.0)),
        ),
    )
    column = builder.select(builder.fcmp_ordered(">", column, nought), column, nought)
    raised = builder.fadd(column, constant(NUMBERS, _EXPONENT))
    shift = builder.and_(builder.bitcast(raised, ROWS), _IN_A_WORD)
    return builder.select(passes, builder.shl(ALL, shift), NOTHING)


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
