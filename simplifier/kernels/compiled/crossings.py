"""LLVM's instructions that list where eight edges cross rows of pixels."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any, NamedTuple

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

_EIGHT = 8
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
    back = spread(builder, builder.sub(CELL(0), builder.trunc(turned, CELL)), CELLS)
    parts, matters, needed = [], [], builder.add(used, WORD(_EIGHT))
    for part in range(0, _EIGHT, LANES):
        named = loaded(builder, CELLS, builder.gep(some, [builder.add(begin, WORD(part))]))
        places = ir.Constant(WORDS, list(range(part, part + LANES)))
        there = builder.icmp_unsigned("<", places, spread(builder, left, WORDS))
        found, close = _upright(builder, vertices, edges, named, there, numbers, near, far)
        found = found._replace(less=builder.xor(found.less, back))
        lengths = builder.sub(found.end, found.begin)
        lengths = builder.select(found.crosses, lengths, constant(CELLS, 0))
        total = call(builder, "vector.reduce.add", CELL, lengths)
        needed = builder.add(needed, builder.zext(total, WORD))
        parts.append(found)
        matters.append(is_set(builder, builder.and_(found.crosses, close)))
    fits = builder.icmp_unsigned("<=", needed, room)
    count = used
    for found in parts:
        count = _list(builder, found, numbers[8:], fits, crossings, count)
    told = builder.select(reduce(builder.or_, matters), WORD(unsure), WORD(0))
    return builder.select(fits, builder.or_(count, told), WORD(no_room))


class _Edges(NamedTuple):
    """Edges from their lower ends on, vectors."""

    crosses: Any  # any row, flags
    less: Any  # all ones where rows count less to their left, had they not been turned
    begin: Any  # the first row
    end: Any  # and the one after the last
    ends: Sequence[Any]  # x and y of the lower end, and of the upper one


def _upright(
    builder: Any, vertices: Any, edges: Any, named: Any, there: Any, numbers: Sequence[Any],
    near: float, far: float,
) -> tuple[_Edges, Any]:  # fmt: skip
    """The edges ``named`` that are ``there``, and flags of where rounding matters."""
    turn = builder.ashr(named, constant(CELLS, 31))
    edge = builder.zext(builder.xor(named, turn), WORDS)
    both = gathered(builder, WORDS, edges, builder.mul(edge, constant(WORDS, _EDGE)))
    one, other = (
        _projected(builder, vertices, vertex, numbers)
        for vertex in (
            builder.and_(both, constant(WORDS, 0xFFFFFFFF)),
            builder.lshr(both, constant(WORDS, 32)),
        )
    )
    first, last = (cell_of(builder, y, numbers[9]) for _, y in (one, other))
    close = builder.or_(*(_on_centre(builder, x, y, near, far) for x, y in (one, other)))
    falls = builder.icmp_unsigned(">", first, last)
    ends = [
        builder.select(falls, b, a)
        for pair in ((one, other), (other, one))
        for a, b in zip(*pair, strict=True)
    ]
    found = _Edges(
        builder.and_(there, builder.icmp_unsigned("!=", first, last)),
        builder.xor(turn, builder.select(falls, constant(CELLS, 0), constant(CELLS, -1))),
        least(builder, first, last),
        greatest(builder, first, last),
        ends,
    )
    return found, close


def _list(
    builder: Any, edges: _Edges, size: Sequence[Any], fits: Any, crossings: Any, used: Any
) -> Any:
    """List the crossings of edges if they fit behind ``used`` others; how many there are then."""
    columns, height = size
    low_x, low_y, high_x, high_y = edges.ends
    rows = builder.fptosi(height, CELLS)

    def cross(row: Any, y: Any, active: Any, count: Any) -> Sequence[Any]:
        x = crossing(builder, low_x, low_y, high_x, high_y, y)
        place = builder.add(builder.mul(cell_of(builder, x, columns), rows), row)
        count = append(builder, [builder.xor(place, edges.less)], active, crossings, count)
        row = builder.add(row, constant(CELLS, 1))
        active = builder.and_(active, builder.icmp_unsigned("<", row, edges.end))
        y = builder.fadd(y, constant(NUMBERS, 1.0))
        return is_set(builder, active), row, y, active, count

    begun = [edges.begin, builder.uitofp(edges.begin, NUMBERS), edges.crosses, used]
    some = builder.and_(fits, is_set(builder, edges.crosses))
    return repeat(builder, some, begun, cross)[-1]


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
