"""LLVM's instructions that draw eight small triangles at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.boxes import write_window
from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.lanes import (
    CELL,
    NUMBER,
    WORD,
    call,
    constant,
    flags_of,
    gathered,
    greatest,
    least,
    loaded,
    spread,
    word_of,
)

LANES = 8
_CELLS = ir.VectorType(CELL, LANES)
_WORDS = ir.VectorType(WORD, LANES)
_NUMBERS = ir.VectorType(NUMBER, LANES)


def write_draw_eight(
    builder: Any, stride: int, points: Any, listed: Any, begin: Any, columns: Any, mask: Any,
    words: Any,
) -> Any:  # fmt: skip
    """As :func:`~..faces.draw_eight` says; ``stride`` faces have room in ``listed``."""
    corners, cells = _listed(builder, stride, listed, begin)
    bottom, bend, top, low, middle, high = _rows_of(builder, corners, cells)
    across = [builder.and_(one, constant(_WORDS, 0xFFFF)) for one in cells]
    window = write_window(builder, least(builder, *across), spread(builder, words, _WORDS))
    (low_x, low_y), (middle_x, middle_y), (high_x, high_y) = (
        _point(builder, points, vertex) for vertex in (low, middle, high)
    )
    step = spread(builder, builder.shl(words, WORD(3)), _WORDS)
    first_place = builder.add(builder.mul(bottom, step), builder.lshr(window, constant(_WORDS, 3)))
    limit = spread(builder, builder.sitofp(columns, NUMBER), _NUMBERS)

    def draw(row: Any, height: Any, place: Any, beyond: Any) -> Sequence[Any]:
        below = builder.icmp_unsigned("<", row, bend)
        start_x, start_y, end_x, end_y = (
            builder.select(below, one, other)
            for one, other in (
                (low_x, middle_x), (low_y, middle_y), (middle_x, high_x), (middle_y, high_y)
            )
        )  # fmt: skip
        ends = (
            _crossing(builder, low_x, low_y, high_x, high_y, height),
            _crossing(builder, start_x, start_y, end_x, end_y, height),
        )
        first = _column(builder, least(builder, *ends), limit)
        end = _column(builder, greatest(builder, *ends), limit)
        there = builder.icmp_unsigned("<", row, top)
        some = builder.and_(there, builder.icmp_unsigned("<", first, end))
        within = builder.and_(
            builder.icmp_unsigned(">=", first, window),
            builder.icmp_unsigned("<=", builder.sub(end, window), constant(_WORDS, 64)),
        )
        outside = builder.xor(within, constant(flags_of(_WORDS), 1))
        beyond = builder.or_(beyond, builder.and_(some, outside))
        bits = _run_of_ones(builder, builder.sub(first, window), builder.sub(end, first))
        bits = builder.select(builder.and_(some, within), bits, constant(_WORDS, 0))
        # Past its last row a triangle adds nothing to its first: no other view's picture is met.
        _add(builder, mask, builder.select(there, place, first_place), bits)
        row = builder.add(row, constant(_WORDS, 1))
        more = word_of(builder, builder.icmp_unsigned("<", row, top))
        return (
            builder.icmp_unsigned("!=", more, WORD(0)),
            row,
            builder.fadd(height, constant(_NUMBERS, 1.0)),
            builder.add(place, step),
            beyond,
        )

    begun = [
        bottom, builder.uitofp(builder.trunc(bottom, _CELLS), _NUMBERS), first_place,
        constant(flags_of(_WORDS), 0),
    ]  # fmt: skip
    *_, beyond = repeat(builder, ir.IntType(1)(1), begun, draw)
    return word_of(builder, beyond)


def _listed(builder: Any, stride: int, listed: Any, begin: Any) -> tuple[list[Any], list[Any]]:
    """The vertices of eight faces' corners, and the cells of these."""
    rows = [
        builder.zext(
            loaded(builder, _CELLS, builder.gep(listed, [builder.add(begin, WORD(stride * row))])),
            _WORDS,
        )
        for row in range(6)
    ]
    return rows[:3], rows[3:]


def _rows_of(builder: Any, corners: Sequence[Any], cells: Sequence[Any]) -> Sequence[Any]:
    """As :func:`~..faces.rows_of`."""
    a, b, c = (
        builder.or_(builder.shl(cell, constant(_WORDS, 32)), corner)
        for corner, cell in zip(corners, cells, strict=True)
    )
    low, high = least(builder, a, b, c), greatest(builder, a, b, c)
    middle = builder.xor(builder.xor(a, b), builder.xor(c, builder.xor(low, high)))
    ordered = (low, middle, high)
    return (
        *(builder.lshr(one, constant(_WORDS, 48)) for one in ordered),
        *(builder.and_(one, constant(_WORDS, 0xFFFFFFFF)) for one in ordered),
    )


def _point(builder: Any, points: Any, vertex: Any) -> Sequence[Any]:
    """x and y."""
    place = builder.shl(vertex, constant(_WORDS, 4))
    return [
        gathered(builder, _NUMBERS, points, builder.add(place, constant(_WORDS, behind)), align=8)
        for behind in (0, 8)
    ]


def _crossing(builder: Any, low_x: Any, low_y: Any, high_x: Any, high_y: Any, height: Any) -> Any:
    """As :func:`~..faces.crossing`, to the last bit."""
    share = builder.fdiv(builder.fsub(height, low_y), builder.fsub(high_y, low_y))
    return builder.fadd(low_x, builder.fmul(share, builder.fsub(high_x, low_x)))


def _column(builder: Any, x: Any, limit: Any) -> Any:
    """The first column at or right of x, on the image."""
    inside = least(builder, greatest(builder, x, constant(_NUMBERS, 0.0)), limit)
    return builder.zext(builder.fptosi(call(builder, "ceil", _NUMBERS, inside), _CELLS), _WORDS)


def _run_of_ones(builder: Any, first: Any, count: Any) -> Any:
    """As :func:`~..faces.run_of_ones`, and anything where there is none."""
    most = constant(_WORDS, 63)
    shift = builder.and_(builder.sub(constant(_WORDS, 64), count), most)
    return builder.shl(builder.lshr(constant(_WORDS, -1), shift), builder.and_(first, most))


def _add(builder: Any, mask: Any, places: Any, bits: Any) -> None:
    """One after the other: two triangles may share a word."""
    base = builder.ptrtoint(mask, WORD)
    for lane in range(LANES):
        offset = builder.extract_element(places, CELL(lane))
        address = builder.inttoptr(builder.add(base, offset), WORD.as_pointer())
        more = builder.extract_element(bits, CELL(lane))
        builder.store(builder.or_(builder.load(address, align=4), more), address, align=4)
