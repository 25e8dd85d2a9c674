"""LLVM's instructions that draw eight small triangles at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.boxes import write_window
from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.edges import cell_of, crossing
from simplifier.kernels.compiled.lanes import (
    CELL,
    CELLS,
    LANES,
    NUMBER,
    NUMBERS,
    WORD,
    WORDS,
    constant,
    flags_of,
    gathered,
    greatest,
    is_set,
    least,
    loaded_rows,
    run_of_ones,
    spread,
    word_of,
)


def write_draw_eight(
    builder: Any, stride: int, points: Any, listed: Any, begin: Any, columns: Any, mask: Any,
    words: Any,
) -> Any:  # fmt: skip
    """As :func:`~..faces.draw_eight` says; ``stride`` faces have room in ``listed``."""
    told = WORD(0)
    for part in range(0, 8, LANES):
        first = builder.add(begin, WORD(part))
        beyond = _draw(builder, stride, points, listed, first, columns, mask, words)
        told = builder.or_(told, builder.shl(beyond, WORD(part)))
    return told


def _draw(
    builder: Any, stride: int, points: Any, listed: Any, begin: Any, columns: Any, mask: Any,
    words: Any,
) -> Any:  # fmt: skip
    """A bit for each of as many faces as there are lanes: those that are not drawn."""
    corners, cells = _listed(builder, stride, listed, begin)
    bottom, bend, top, low, middle, high = _rows_of(builder, corners, cells)
    across = [builder.and_(one, constant(WORDS, 0xFFFF)) for one in cells]
    window = write_window(builder, least(builder, *across), spread(builder, words, WORDS))
    (low_x, low_y), (middle_x, middle_y), (high_x, high_y) = (
        _point(builder, points, vertex) for vertex in (low, middle, high)
    )
    step = spread(builder, builder.shl(words, WORD(3)), WORDS)
    first_place = builder.add(builder.mul(bottom, step), builder.lshr(window, constant(WORDS, 3)))
    limit = spread(builder, builder.sitofp(columns, NUMBER), NUMBERS)

    def draw(row: Any, height: Any, place: Any, beyond: Any) -> Sequence[Any]:
        below = builder.icmp_unsigned("<", row, bend)
        start_x, start_y, end_x, end_y = (
            builder.select(below, one, other)
            for one, other in (
                (low_x, middle_x), (low_y, middle_y), (middle_x, high_x), (middle_y, high_y)
            )
        )  # fmt: skip
        ends = (
            crossing(builder, low_x, low_y, high_x, high_y, height),
            crossing(builder, start_x, start_y, end_x, end_y, height),
        )
        first = builder.zext(cell_of(builder, least(builder, *ends), limit), WORDS)
        end = builder.zext(cell_of(builder, greatest(builder, *ends), limit), WORDS)
        there = builder.icmp_unsigned("<", row, top)
        some = builder.and_(there, builder.icmp_unsigned("<", first, end))
        within = builder.and_(
            builder.icmp_unsigned(">=", first, window),
            builder.icmp_unsigned("<=", builder.sub(end, window), constant(WORDS, 64)),
        )
        outside = builder.xor(within, constant(flags_of(WORDS), 1))
        beyond = builder.or_(beyond, builder.and_(some, outside))
        bits = run_of_ones(builder, builder.sub(first, window), builder.sub(end, first))
        bits = builder.select(builder.and_(some, within), bits, constant(WORDS, 0))
        # Past its last row a triangle adds nothing to its first: no other view's picture is met.
        _add(builder, mask, builder.select(there, place, first_place), bits)
        row = builder.add(row, constant(WORDS, 1))
        return (
            is_set(builder, builder.icmp_unsigned("<", row, top)),
            row,
            builder.fadd(height, constant(NUMBERS, 1.0)),
            builder.add(place, step),
            beyond,
        )

    begun = [
        bottom, builder.uitofp(builder.trunc(bottom, CELLS), NUMBERS), first_place,
        constant(flags_of(WORDS), 0),
    ]  # fmt: skip
    *_, beyond = repeat(builder, ir.IntType(1)(1), begun, draw)
    return word_of(builder, beyond)


def _listed(builder: Any, stride: int, listed: Any, begin: Any) -> tuple[list[Any], list[Any]]:
    """The vertices of faces' corners, and the cells of these."""
    lists = loaded_rows(builder, CELLS, listed, begin, stride, 6)
    rows = [builder.zext(one, WORDS) for one in lists]
    return rows[:3], rows[3:]


def _rows_of(builder: Any, corners: Sequence[Any], cells: Sequence[Any]) -> Sequence[Any]:
    """As :func:`~..faces.rows_of`."""
    a, b, c = (
        builder.or_(builder.shl(cell, constant(WORDS, 32)), corner)
        for corner, cell in zip(corners, cells, strict=True)
    )
    low, high = least(builder, a, b, c), greatest(builder, a, b, c)
    middle = builder.xor(builder.xor(a, b), builder.xor(c, builder.xor(low, high)))
    ordered = (low, middle, high)
    return (
        *(builder.lshr(one, constant(WORDS, 48)) for one in ordered),
        *(builder.and_(one, constant(WORDS, 0xFFFFFFFF)) for one in ordered),
    )


def _point(builder: Any, points: Any, vertex: Any) -> Sequence[Any]:
    """x and y."""
    place = builder.shl(vertex, constant(WORDS, 4))
    return [
        gathered(builder, NUMBERS, points, builder.add(place, constant(WORDS, behind)), align=8)
        for behind in (0, 8)
    ]


def _add(builder: Any, mask: Any, places: Any, bits: Any) -> None:
    """One after the other: two triangles may share a word."""
    base = builder.ptrtoint(mask, WORD)
    for lane in range(LANES):
        offset = builder.extract_element(places, CELL(lane))
        address = builder.inttoptr(builder.add(base, offset), WORD.as_pointer())
        more = builder.extract_element(bits, CELL(lane))
        builder.store(builder.or_(builder.load(address, align=4), more), address, align=4)
