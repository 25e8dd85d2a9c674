"""Ones of several vectors, counted in LLVM's instructions.

Where no instruction counts those of each word of a register, they are counted column by column, in
binary: to add vectors digit by digit takes less than to count the ones of each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce
from typing import Any

from simplifier.kernels.compiled.lanes import WORD, call, constant
from simplifier.kernels.compiled.processors import Processor


def ones_of(builder: Any, vectors: Sequence[Any]) -> Any:
    """How many ones there are, a uint64; of 2, 4, 8 or 16 vectors of uint64."""
    kind = vectors[0].type
    if Processor.chosen().counts_ones:
        return _sum(builder, ones_of_words(builder, vectors))
    digits = [constant(kind, 0)] * (len(vectors).bit_length() - 1)
    last = add(builder, digits, iter(vectors), len(vectors))
    return worth_of(builder, [*digits, last])


def add(builder: Any, digits: list[Any], values: Iterator[Any], count: int) -> Any:
    """Add ``count`` vectors, 2, 4, 8 or 16, to as many binary digits, lowest first, as that is
    doubled, which change; what is carried out of the last one."""
    if count == 1:
        return next(values)
    one, two = (add(builder, digits, values, count // 2) for _ in range(2))
    place = count.bit_length() - 2
    was, either = digits[place], builder.xor(one, two)
    digits[place] = builder.xor(was, either)
    return builder.or_(builder.and_(one, two), builder.and_(was, either))


def worth_of(builder: Any, digits: Sequence[Any]) -> Any:
    """What binary digits, lowest first, come to in all columns, a uint64."""
    worths = (
        builder.shl(ones_of_words(builder, [digit]), constant(digit.type, place))
        for place, digit in enumerate(digits)
    )
    return _sum(builder, reduce(builder.add, worths))


def ones_of_words(builder: Any, vectors: Sequence[Any]) -> Any:
    """How many ones the words of all vectors have lane by lane, a vector."""
    return reduce(builder.add, (call(builder, "ctpop", one.type, one) for one in vectors))


def _sum(builder: Any, vector: Any) -> Any:
    return call(builder, "vector.reduce.add", WORD, vector)
