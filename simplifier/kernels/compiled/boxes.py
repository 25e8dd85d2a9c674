"""LLVM's instructions that tell which triangles of a view have to be drawn, 16 or 8 at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.lanes import (
    CELL,
    LANES,
    WORD,
    append,
    constant,
    flags_of,
    gathered,
    greatest,
    is_set,
    least,
    loaded,
    loaded_rows,
    moved,
    run_of_ones,
    spread,
    word_of,
)

_LANES = 2 * LANES  # of numbers of 32 bits, which fill a register
_GROUP = ir.VectorType(CELL, 16)
_CELLS = ir.VectorType(CELL, _LANES)
_WORDS = ir.VectorType(WORD, _LANES)
_NEITHER = constant(flags_of(_CELLS), 0)
_EACH = constant(flags_of(_CELLS), 1)


def write_list_pictured(
    builder: Any, stride: int, cells: Any, faces: Any, begin: Any, listed: Any, count: Any
) -> Any:
    """As :func:`~..faces.list_pictured` says; ``stride`` faces have room in ``listed``."""
    for group in range(0, 64, 16):
        first = builder.mul(builder.add(begin, WORD(group)), WORD(3))
        corners = _corners(builder, builder.gep(faces, [first]))
        p, q, r = (gathered(builder, _GROUP, cells, _bytes(builder, one, 4)) for one in corners)
        differ = builder.or_(builder.xor(p, q), builder.xor(p, r))
        columns = builder.and_(differ, constant(_GROUP, 0xFFFF))
        pictured = builder.and_(
            builder.icmp_unsigned("!=", columns, constant(_GROUP, 0)),
            builder.icmp_unsigned(">", differ, constant(_GROUP, 0xFFFF)),
        )
        count = append(builder, [*corners, p, q, r], pictured, listed, count, stride)
    return count


def write_list_bare(
    builder: Any, stride: int, listed: Any, begin: Any, mask: Any, words: Any, most_rows: Any,
    bare: Any, count: Any,
) -> Any:  # fmt: skip
    """As :func:`~..faces.list_bare` says."""
    large = WORD(0)
    for part in range(0, 16, _LANES):
        first = builder.add(begin, WORD(part))
        count, more = _list_bare(
            builder, stride, listed, first, mask, words, most_rows, bare, count
        )  # fmt: skip
        large = builder.or_(large, builder.shl(more, WORD(part)))
    return builder.or_(count, builder.shl(large, WORD(32)))


def _list_bare(
    builder: Any, stride: int, listed: Any, begin: Any, mask: Any, words: Any, most_rows: Any,
    bare: Any, count: Any,
) -> Sequence[Any]:  # fmt: skip
    """How many are listed after a vector of faces, and a bit for each large one."""
    rows = loaded_rows(builder, _CELLS, listed, begin, stride, 6)
    bottom, top, left, right = _box(builder, rows[3:])
    window = write_window(builder, left, spread(builder, builder.trunc(words, CELL), _CELLS))
    height = builder.sub(top, bottom)
    small = builder.and_(
        builder.icmp_unsigned("<=", builder.sub(right, window), constant(_CELLS, 64)),
        builder.icmp_unsigned(
            "<=", height, spread(builder, builder.trunc(most_rows, CELL), _CELLS)
        ),
    )
    shift, wide = (
        builder.zext(builder.sub(end, begin), _WORDS)
        for begin, end in ((window, left), (left, right))
    )
    columns = run_of_ones(builder, shift, wide)
    step = spread(builder, builder.shl(words, WORD(3)), _WORDS)
    first = builder.add(
        builder.mul(builder.zext(bottom, _WORDS), step),
        builder.zext(builder.lshr(window, constant(_CELLS, 3)), _WORDS),
    )

    def look(row: Any, place: Any, asked: Any, lacking: Any) -> Sequence[Any]:
        there = gathered(builder, _WORDS, mask, place, asked)
        missing = builder.icmp_unsigned("!=", builder.and_(there, columns), columns)
        lacking = builder.or_(lacking, builder.and_(asked, missing))
        row = builder.add(row, constant(_CELLS, 1))
        more = builder.and_(builder.icmp_unsigned("<", row, height), builder.xor(missing, _EACH))
        asked = builder.and_(asked, more)
        return is_set(builder, asked), row, builder.add(place, step), asked, lacking

    begun = [constant(_CELLS, 0), first, small, _NEITHER]
    *_, lacking = repeat(builder, is_set(builder, small), begun, look)
    count = append(builder, rows, lacking, bare, count, stride)
    return count, word_of(builder, builder.xor(small, _EACH))


def write_window(builder: Any, left: Any, words: Any) -> Any:
    """The first of 64 columns, a multiple of 32, among which the column ``left`` and the 32 behind
    it are; ``words`` in a row."""
    kind = left.type
    last = builder.shl(builder.sub(words, constant(kind, 1)), constant(kind, 6))
    return least(builder, builder.and_(left, constant(kind, 0xFFE0)), last)


def _corners(builder: Any, address: Any) -> list[Any]:
    """The first, second and third corners of 16 faces, which lie one after the other."""
    kind = ir.VectorType(CELL, 48)
    whole = loaded(builder, kind, address)
    return [moved(builder, whole, whole, range(corner, 48, 3)) for corner in range(3)]


def _bytes(builder: Any, places: Any, size: int) -> Any:
    """How far into an array numbers of that size lie."""
    kind = ir.VectorType(WORD, places.type.count)
    return builder.mul(builder.zext(places, kind), constant(kind, size))


def _box(builder: Any, cells: Sequence[Any]) -> Sequence[Any]:
    """The first row and the end, and the first column and the end, of triangles."""
    rows = [builder.lshr(one, constant(_CELLS, 16)) for one in cells]
    columns = [builder.and_(one, constant(_CELLS, 0xFFFF)) for one in cells]
    return (
        least(builder, *rows), greatest(builder, *rows),
        least(builder, *columns), greatest(builder, *columns),
    )  # fmt: skip
