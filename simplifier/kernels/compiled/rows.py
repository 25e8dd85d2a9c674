"""Images of 64 x 64 bits in vector registers, in LLVM's instructions.

A vector is eight rows of 64 bits, so eight of them are an image, and one of 512 bits is a register.
Where registers are shorter, the compiler takes several for each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import llvmlite.ir as ir

LANES = 8
"""Rows of a vector."""

WORD = ir.IntType(64)
ROWS = ir.VectorType(WORD, LANES)
NOTHING = ir.Constant(ROWS, [0] * LANES)
ALL = ir.Constant(ROWS, [-1] * LANES)
Vectors = Sequence[Any]
"""Eight values of LLVM's, the rows of an image from the top."""


def place_of(builder: Any, address: Any, row: Any) -> Any:
    """The address of a row, a number or a value of LLVM's."""
    return builder.gep(address, [WORD(row) if isinstance(row, int) else row])


def load_rows(builder: Any, place: Any) -> Any:
    """Eight rows from an address on."""
    return builder.load(builder.bitcast(place, ROWS.as_pointer()), align=8)


def load_image(builder: Any, address: Any) -> Vectors:
    """An image from an address on."""
    return [load_rows(builder, place_of(builder, address, row)) for row in range(0, 64, LANES)]


def store_rows(builder: Any, rows: Any, place: Any) -> None:
    """Eight rows to an address."""
    builder.store(rows, builder.bitcast(place, ROWS.as_pointer()), align=8)


def is_any(builder: Any, rows: Any) -> Any:
    """Whether any bit of eight rows is one."""
    return builder.icmp_unsigned("!=", call(builder, "vector.reduce.or", WORD, rows), WORD(0))


def all_but_one(builder: Any, once: Any, twice: Any, own: Any) -> Any:
    """Rows of the union of all pictures but ``own``, by the rows that any and that two have."""
    others = builder.and_(once, builder.xor(own, ALL))
    return builder.or_(others, builder.and_(twice, own))


def call(builder: Any, name: str, result: Any, vector: Any) -> Any:
    """One of LLVM's own functions of a vector."""
    letter = "i" if vector.type.element == WORD else "f"
    name, kind = f"llvm.{name}.v{LANES}{letter}64", ir.FunctionType(result, [vector.type])
    known = builder.module.globals.get(name)
    return builder.call(known or ir.Function(builder.module, kind, name), [vector])


def merged(builder: Any, kind: Any, block: Any, value: Any) -> Any:
    """What has that value when control comes from that block; others are added."""
    found = builder.phi(kind)
    found.add_incoming(value, block)
    return found


def repeat(
    builder: Any, at_all: Any, before: Sequence[Any], step: Callable[..., Sequence[Any]]
) -> Sequence[Any]:
    """A loop over what changes from round to round; its values after the last one.

    ``at_all``  whether there is a first round.
    ``before``  the values that it begins with.
    ``step``    writes a round, which is given them; returns whether another follows, and the values
                that it begins with.
    """
    entry = builder.basic_block
    begin, after = builder.append_basic_block("round"), builder.append_basic_block("after")
    builder.cbranch(at_all, begin, after)
    builder.position_at_end(begin)
    now = [merged(builder, value.type, entry, value) for value in before]
    again, *found = step(*now)
    end = builder.basic_block
    for value, following in zip(now, found, strict=True):
        value.add_incoming(following, end)
    builder.cbranch(again, begin, after)
    builder.position_at_end(after)
    last = [merged(builder, value.type, entry, value) for value in before]
    for value, following in zip(last, found, strict=True):
        value.add_incoming(following, end)
    return last
