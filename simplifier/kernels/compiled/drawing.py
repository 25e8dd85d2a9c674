"""LLVM's instructions that draw a triangle into a bit image, and count it among others.

Loops over rows compile to more: numba asks of each index whether it counts from the end, and the
compiler of each pair of arrays whether they share memory, which takes as long as eight rows.
"""

from __future__ import annotations

from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.rows import (
    ALL,
    LANES,
    NOTHING,
    ROWS,
    WORD,
    all_but_one,
    call,
    is_any,
    load_rows,
    merged,
    place_of,
    store_rows,
)

_NUMBER = ir.DoubleType()
_NUMBERS = ir.VectorType(_NUMBER, LANES)
_IN_A_WORD = ir.Constant(ROWS, [63] * LANES)
_EXPONENT = 2.0**52  # a whole number below it is in the last bits of the sum


def write_draw(
    builder: Any, block: int, edges: Any, view: Any, layers: Any, height: Any, own: Any, new: Any,
    eights: Any,
) -> Any:  # fmt: skip
    """As :func:`~..soup_views.draw_found` says; ``block`` views have a number after the other."""
    for begin in range(0, 64, LANES):
        store_rows(builder, NOTHING, place_of(builder, new, begin))

    def number(place: int) -> Any:
        return builder.load(builder.gep(edges, [builder.add(view, WORD(place * block))]))

    outlines = [
        [_all(builder, number(5 * edge + which)) for which in range(5)] for edge in range(3)
    ]
    first, end = (builder.fptosi(number(15 + which), WORD) for which in range(2))
    middles = ir.Constant(_NUMBERS, [row + 0.5 for row in range(LANES)])
    middles = builder.fadd(_all(builder, number(15)), middles)
    second = place_of(builder, layers, height)
    entry = builder.basic_block
    body, done = builder.append_basic_block("eight"), builder.append_basic_block("drawn")
    builder.cbranch(builder.icmp_signed("<", first, end), body, done)
    builder.position_at_end(body)
    row = merged(builder, WORD, entry, first)
    middle = merged(builder, _NUMBERS, entry, middles)
    differs = merged(builder, ROWS, entry, NOTHING)
    changed = merged(builder, WORD, entry, WORD(0))
    bits = NOTHING
    for outline in outlines:
        bits = builder.xor(bits, _right_of(builder, outline, middle))
    store_rows(builder, bits, place_of(builder, new, row))
    here, whole, twice = (
        load_rows(builder, place_of(builder, image, row)) for image in (own, layers, second)
    )
    union = builder.or_(all_but_one(builder, whole, twice, here), bits)
    change = builder.xor(union, whole)
    found = builder.or_(differs, change)
    moved = builder.zext(is_any(builder, builder.xor(bits, here)), WORD)
    marked = builder.or_(changed, builder.shl(moved, builder.lshr(row, WORD(3))))
    following = builder.add(row, WORD(LANES))
    row.add_incoming(following, body)
    eight = ir.Constant(_NUMBERS, [float(LANES)] * LANES)
    middle.add_incoming(builder.fadd(middle, eight), body)
    differs.add_incoming(found, body)
    changed.add_incoming(marked, body)
    builder.cbranch(builder.icmp_signed("<", following, end), body, done)
    builder.position_at_end(done)
    total = merged(builder, ROWS, entry, NOTHING)
    marks = merged(builder, WORD, entry, WORD(0))
    total.add_incoming(found, body)
    marks.add_incoming(marked, body)
    builder.store(marks, eights)
    return call(builder, "vector.reduce.or", WORD, total)


def _right_of(builder: Any, edge: Any, middle: Any) -> Any:
    """As :func:`~..bit_image.edge_bits`, of eight rows by their middles."""
    start, top, slope, first, last = edge
    column = builder.fadd(start, builder.fmul(builder.fsub(middle, top), slope))
    column = call(builder, "ceil", _NUMBERS, column)
    nought = ir.Constant(_NUMBERS, [0.0] * LANES)
    passes = builder.and_(
        builder.fcmp_ordered(">", middle, first),
        builder.and_(
            builder.fcmp_ordered("<", middle, last),
            builder.fcmp_ordered("<", column, ir.Constant(_NUMBERS, [64.0] * LANES)),
        ),
    )
    column = builder.select(builder.fcmp_ordered(">", column, nought), column, nought)
    raised = builder.fadd(column, ir.Constant(_NUMBERS, [_EXPONENT] * LANES))
    shift = builder.and_(builder.bitcast(raised, ROWS), _IN_A_WORD)
    return builder.select(passes, builder.shl(ALL, shift), NOTHING)


def _all(builder: Any, number: Any) -> Any:
    """A vector of a number eight times."""
    undefined = ir.Constant(_NUMBERS, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, undefined, order)


def write_exchange(
    builder: Any, layers: Any, digits: Any, height: Any, old: Any, new: Any, eights: Any
) -> Any:
    """As :func:`~..soup_views.exchange_picture` says; 0."""
    lowest = builder.gep(layers, [builder.mul(height, WORD(2))])
    entry = builder.basic_block
    names = ("eight", "change", "digit", "counted", "high", "sum", "following", "done")
    eight, change, digit, counted, high, total, following, done = (
        builder.append_basic_block(name) for name in names
    )
    builder.cbranch(builder.icmp_unsigned("!=", eights, WORD(0)), eight, done)

    builder.position_at_end(eight)
    left = merged(builder, WORD, entry, eights)
    row = builder.shl(builder.cttz(left, ir.IntType(1)(1)), WORD(3))
    before, after = (load_rows(builder, place_of(builder, image, row)) for image in (old, new))
    differs = builder.xor(before, after)
    builder.cbranch(is_any(builder, differs), change, following)

    builder.position_at_end(change)
    lost = builder.and_(before, builder.xor(after, ALL))
    store_rows(builder, after, place_of(builder, old, row))
    first = builder.gep(lowest, [row])
    builder.branch(digit)

    builder.position_at_end(digit)
    place = merged(builder, first.type, change, first)
    carry = merged(builder, ROWS, change, differs)
    was = load_rows(builder, place)
    store_rows(builder, builder.xor(was, carry), place)
    carried = builder.and_(carry, builder.xor(was, lost))
    place.add_incoming(builder.gep(place, [height]), digit)
    carry.add_incoming(carried, digit)
    builder.cbranch(is_any(builder, carried), digit, counted)

    builder.position_at_end(counted)
    low = load_rows(builder, first)
    begin = builder.gep(first, [height])
    builder.branch(high)

    builder.position_at_end(high)
    count = merged(builder, WORD, counted, WORD(1))
    place = merged(builder, first.type, counted, begin)
    several = merged(builder, ROWS, counted, NOTHING)
    more = builder.or_(several, load_rows(builder, place))
    counts = builder.add(count, WORD(1))
    count.add_incoming(counts, high)
    place.add_incoming(builder.gep(place, [height]), high)
    several.add_incoming(more, high)
    builder.cbranch(builder.icmp_signed("<", counts, digits), high, total)

    builder.position_at_end(total)
    store_rows(builder, builder.or_(low, more), place_of(builder, layers, row))
    store_rows(builder, more, builder.gep(layers, [builder.add(height, row)]))
    builder.branch(following)

    builder.position_at_end(following)
    rest = builder.and_(left, builder.sub(left, WORD(1)))
    left.add_incoming(rest, following)
    builder.cbranch(builder.icmp_unsigned("!=", rest, WORD(0)), eight, done)
    builder.position_at_end(done)
    return WORD(0)
