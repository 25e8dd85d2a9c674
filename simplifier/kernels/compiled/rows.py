"""Images of 64 x 64 bits in vector registers, in LLVM's instructions.

A vector is eight rows of 64 bits, so eight of them are an image, and one of 512 bits is a register.
Where registers are shorter, the compiler takes several for each.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.lanes import WORD, call, constant

EIGHT = 8
ROWS = ir.VectorType(WORD, EIGHT)
NOTHING = constant(ROWS, 0)
ALL = constant(ROWS, -1)
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
    return [load_rows(builder, place_of(builder, address, row)) for row in range(0, 64, EIGHT)]


def store_rows(builder: Any, rows: Any, place: Any) -> None:
    """Eight rows to an address."""
    builder.store(rows, builder.bitcast(place, ROWS.as_pointer()), align=8)


def is_any(builder: Any, *several: Any) -> Any:
    """Whether any bit of vectors of rows is one."""
    rows = reduce(builder.or_, several)
    return builder.icmp_unsigned("!=", call(builder, "vector.reduce.or", WORD, rows), WORD(0))


def between_ones(builder: Any, rows: Any) -> Any:
    """The bits of rows whose neighbours on both sides are ones."""
    one = constant(rows.type, 1)
    return builder.and_(builder.shl(rows, one), builder.lshr(rows, one))


def all_but_one(builder: Any, once: Any, twice: Any, own: Any) -> Any:
    """Rows of the union of all pictures but ``own``, by the rows that any and that two have."""
    others = builder.and_(once, builder.xor(own, ALL))
    return builder.or_(others, builder.and_(twice, own))
