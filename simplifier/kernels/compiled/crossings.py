"""LLVM's instructions that list where eight edges cross rows of pixels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.edges import cell_of, crossing
from simplifier.kernels.compiled.lanes import (
    CELL,
    CELLS,
    LANES,
    NUMBERS,
    WORD,
    WORDS,
    append,
    call,
    constant,
    gathered,
    greatest,
    is_set,
    least,
    loaded,
    spread,
)

_POINT = 24  # bytes
_EDGE = 16


def write_list_eight(
    builder: Any, near: float, far: float, unsure: int, no_room: int, vertices: Any, edges: Any,
    some: Any, begin: Any, left: Any, view: Any, turned: Any, crossings: Any, room: Any, used: Any,
) -> Any:  # fmt: skip
    """As :func:`~..contours.list_eight` says; ``near`` and ``far`` in pixels, ``unsure`` and
    ``no_room`` what else it tells than how many are listed."""
    numbers = [
        spread(builder, builder.load(builder.gep(view, [WORD(place)])), NUMBERS)
        for place in range(10)
    ]
    columns, height = numbers[8:]
    named = loaded(builder, CELLS, builder.gep(some, [begin]))
    turn = builder.ashr(named, constant(CELLS, 31))
    edge = builder.zext(builder.xor(named, turn), WORDS)
    ends = gathered(builder, WORDS, edges, builder.mul(edge, constant(WORDS, _EDGE)))
    low, high = (
        _projected(builder, vertices, vertex, numbers)
        for vertex in (
            builder.and_(ends, constant(WORDS, 0xFFFFFFFF)),
            builder.lshr(ends, constant(WORDS, 32)),
        )
    )
    first, last = (cell_of(builder, y, height) for _, y in (low, high))
    lanes = ir.Constant(WORDS, list(range(LANES)))
    crosses = builder.and_(
        builder.icmp_unsigned("<", lanes, spread(builder, left, WORDS)),
        builder.icmp_unsigned("!=", first, last),
    )
    close = builder.or_(*(_on_centre(builder, x, y, near, far) for x, y in (low, high)))
    matters = builder.and_(crosses, close)

    falls = builder.icmp_unsigned(">", first, last)
    (low_x, low_y), (high_x, high_y) = (
        [builder.select(falls, b, a) for a, b in zip(one, other, strict=True)]
        for one, other in ((low, high), (high, low))
    )
    begins, end = least(builder, first, last), greatest(builder, first, last)
    less = builder.xor(
        turn, spread(builder, builder.sub(CELL(0), builder.trunc(turned, CELL)), CELLS)
    )
    less = builder.xor(less, builder.select(falls, constant(CELLS, 0), constant(CELLS, -1)))
    rows = builder.fptosi(height, CELLS)

    lengths = builder.select(crosses, builder.sub(end, begins), constant(CELLS, 0))
    total = builder.zext(call(builder, "vector.reduce.add", CELL, lengths), WORD)
    needed = builder.add(builder.add(used, total), WORD(LANES))
    fits = builder.icmp_unsigned("<=", needed, room)

    def cross(row: Any, y: Any, active: Any, count: Any) -> Sequence[Any]:
        x = crossing(builder, low_x, low_y, high_x, high_y, y)
        place = builder.add(builder.mul(cell_of(builder, x, columns), rows), row)
        count = append(builder, [builder.xor(place, less)], active, crossings, count)
        row = builder.add(row, constant(CELLS, 1))
        active = builder.and_(active, builder.icmp_unsigned("<", row, end))
        y = builder.fadd(y, constant(NUMBERS, 1.0))
        return is_set(builder, active), row, y, active, count

    begun = [begins, builder.uitofp(begins, NUMBERS), crosses, used]
    *_, count = repeat(builder, builder.and_(fits, is_set(builder, crosses)), begun, cross)
    told = builder.select(is_set(builder, matters), WORD(unsure), WORD(0))
    return builder.select(fits, builder.or_(count, told), WORD(no_room))


def _projected(builder: Any, vertices: Any, vertex: Any, numbers: Sequence[Any]) -> Sequence[Any]:
    """Image coordinates of vertices, bit for bit as :func:`~..faces.project`."""
    place = builder.mul(vertex, constant(WORDS, _POINT))
    x, y, z = (
        gathered(builder, NUMBERS, vertices, builder.add(place, constant(WORDS, behind)), align=8)
        for behind in (0, 8, 16)
    )
    return [
        builder.fadd(
            builder.fadd(builder.fadd(builder.fmul(a, x), builder.fmul(b, y)), builder.fmul(c, z)),
            d,
        )
        for a, b, c, d in (numbers[:4], numbers[4:8])
    ]


def _on_centre(builder: Any, x: Any, y: Any, near: float, far: float) -> Any:
    """As :func:`~..contours._on_centre`."""
    close, away = [], []
    for value in (x, y):
        off = builder.fsub(value, call(builder, "rint", NUMBERS, value))
        close.append(_is(builder, "<", _size(builder, off), near))
        away.append(_is(builder, ">", _size(builder, value), far))
    return builder.or_(builder.and_(*close), builder.or_(*away))


def _size(builder: Any, value: Any) -> Any:
    return call(builder, "fabs", NUMBERS, value)


def _is(builder: Any, order: str, value: Any, limit: float) -> Any:
    return builder.fcmp_ordered(order, value, constant(NUMBERS, limit))
