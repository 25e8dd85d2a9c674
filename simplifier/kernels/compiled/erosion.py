"""LLVM's instructions that measure a 64 x 64 bit image, in vector registers while it is eroded.

A vector is eight rows, so eight of them are an image, and one of 512 bits is a register.  Kept in
memory, each erosion would read rows that the one before has just written, eight at a time and from
other places: the processor waits for that longer than it computes.  Where registers are shorter,
the compiler keeps parts in memory, which takes as long as a loop over the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

_LANES = 8
_WORD = ir.IntType(64)
_ROWS = ir.VectorType(_WORD, _LANES)
_NOTHING = ir.Constant(_ROWS, [0] * _LANES)
_ONE = ir.Constant(_ROWS, [1] * _LANES)
Vectors = Sequence[Any]
"""Eight values of LLVM's, the rows of an image from the top."""


def write_measure(builder: Any, address: Any, steps: str) -> Any:
    """Twice the measure of the 64 words at an address, as :func:`~..bit_image.measure_twice` says.

    A loop over ``steps``, of crosses ``+`` and squares ``x``, that ends with the first image in
    which nothing is left.
    """
    image = _load(builder, address)
    first = _areas(builder, image)
    entry = builder.basic_block
    begin, end = builder.append_basic_block("begin"), builder.append_basic_block("end")
    builder.cbranch(_any(builder, first), begin, end)
    builder.position_at_end(begin)
    at_begin = [_either(builder, entry, rows) for rows in image]
    so_far = _either(builder, entry, _NOTHING)
    image, areas, ends = at_begin, so_far, []
    for step in steps:
        image = _eroded(builder, image, step)
        left = _areas(builder, image)
        areas = builder.add(areas, left)
        ends.append((areas, builder.basic_block))
        following = builder.append_basic_block(step) if len(ends) < len(steps) else begin
        builder.cbranch(_any(builder, left), following, end)
        builder.position_at_end(following)
    for value, rows in zip((*at_begin, so_far), (*image, areas), strict=True):
        value.add_incoming(rows, ends[-1][1])
    builder.position_at_end(end)
    total = _either(builder, entry, _NOTHING)
    for areas, block in ends:
        total.add_incoming(areas, block)
    return _sum(builder, builder.add(first, builder.shl(total, _ONE)))


def _either(builder: Any, block: Any, value: Any) -> Any:
    """A vector that has that value when control came from that block."""
    found = builder.phi(_ROWS)
    found.add_incoming(value, block)
    return found


def _load(builder: Any, address: Any) -> Vectors:
    vectors = []
    for row in range(0, 64, _LANES):
        place = builder.gep(address, [_WORD(row)])
        vectors.append(builder.load(builder.bitcast(place, _ROWS.as_pointer()), align=8))
    return vectors


def _eroded(builder: Any, image: Vectors, step: str) -> Vectors:
    above = ir.Constant(ir.VectorType(ir.IntType(32), _LANES), [7, 8, 9, 10, 11, 12, 13, 14])
    below = ir.Constant(ir.VectorType(ir.IntType(32), _LANES), [1, 2, 3, 4, 5, 6, 7, 8])
    framed = [_NOTHING, *image, _NOTHING]
    result = []
    for before, rows, after in zip(framed, image, framed[2:], strict=False):
        upright = builder.and_(
            builder.shuffle_vector(before, rows, above), builder.shuffle_vector(rows, after, below)
        )
        if step == "x":
            rows, upright = builder.and_(rows, upright), rows
        level = builder.and_(builder.shl(rows, _ONE), builder.lshr(rows, _ONE))
        result.append(builder.and_(rows, builder.and_(upright, level)))
    return result


def _areas(builder: Any, image: Vectors) -> Any:
    """Ones in every eighth row, a vector."""
    total = None
    for rows in image:
        ones = _call(builder, "ctpop", _ROWS, rows)
        total = ones if total is None else builder.add(total, ones)
    return total


def _any(builder: Any, vector: Any) -> Any:
    return builder.icmp_unsigned("!=", _call(builder, "vector.reduce.or", _WORD, vector), _WORD(0))


def _sum(builder: Any, vector: Any) -> Any:
    return _call(builder, "vector.reduce.add", _WORD, vector)


def _call(builder: Any, name: str, result: Any, vector: Any) -> Any:
    name, kind = f"llvm.{name}.v{_LANES}i64", ir.FunctionType(result, [_ROWS])
    known = builder.module.globals.get(name)
    return builder.call(known or ir.Function(builder.module, kind, name), [vector])
