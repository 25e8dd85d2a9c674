"""LLVM's instructions that measure 64 x 64 bit images where registers are too short for two of
them, or no instruction counts the ones of a register.

A vector holds rows that lie far apart: of sixteen vectors of four, number ``i`` has the rows ``i``,
``16 + i``, ``32 + i`` and ``48 + i``.  The rows next to these are then the vectors next to it, so
an erosion moves no row within a register.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import llvmlite.ir as ir

from simplifier.kernels.compiled.control import repeat
from simplifier.kernels.compiled.counting import add, ones_of_words, worth_of
from simplifier.kernels.compiled.lanes import LANES, WORD, WORDS, call, constant, moved
from simplifier.kernels.compiled.rows import EIGHT, Vectors, between_ones, is_any

_COUNT, _BYTES = 64 // LANES, 8 * LANES
_HALVES = _COUNT.bit_length() - 1  # that a vector of each makes
_NOTHING = constant(WORDS, 0)
_FUNCTION = "measure_turned"


def measure_turned(builder: Any, image: Vectors, steps: str) -> Any:
    """Twice the measure of an image, as :func:`~..bit_image.measure_twice` says."""
    with builder.goto_entry_block():
        place = builder.alloca(WORDS, size=_COUNT)
        place.align = _BYTES
    for at, rows in enumerate(_turned(builder, image)):
        _store(builder, rows, place, at)
    return builder.call(_function(builder.module, steps), [place])


def _turned(builder: Any, image: Vectors) -> Sequence[Any]:
    """The vectors of an image, with rows that lie far apart."""
    close = [
        moved(builder, rows, rows, range(begin, begin + LANES))
        for rows in image
        for begin in range(0, EIGHT, LANES)
    ]
    squares = len(close) // LANES
    return [
        rows
        for first in range(squares)
        for rows in _transposed(builder, close[first::squares])
    ]  # fmt: skip


def _transposed(builder: Any, square: Sequence[Any]) -> Sequence[Any]:
    """Of as many vectors as each has lanes, the rows as columns."""
    found, lanes = list(square), range(LANES)
    width = LANES // 2
    while width:
        for one in lanes:
            if one & width == 0:
                other = one + width
                pair = found[one], found[other]
                orders = (
                    [lane + (LANES - width if lane & width else 0) for lane in lanes],
                    [lane + (LANES if lane & width else width) for lane in lanes],
                )
                found[one], found[other] = (moved(builder, *pair, order) for order in orders)
        width //= 2
    return found


def _function(module: Any, steps: str) -> Any:
    """Twice the measure of the image at an address, which is overwritten.

    One function, which all of a file call: it is as long as all the rest of each of them.
    """
    if _FUNCTION not in module.globals:
        takes = ir.FunctionType(WORD, [WORDS.as_pointer()])
        function = ir.Function(module, takes, _FUNCTION)
        function.linkage = "linkonce_odr"
        function.attributes.add("noinline")
        function.attributes.alignstack = _BYTES
        builder = ir.IRBuilder(function.append_basic_block())
        builder.ret(_measure(builder, function.args[0], steps))
    return module.globals[_FUNCTION]


def _measure(builder: Any, place: Any, steps: str) -> Any:
    # Digits are worth a half, one, two and so on: the first image counts half.
    first = [_NOTHING] * _HALVES
    last = add(builder, first, (_load(builder, place, at) for at in range(_COUNT)), _COUNT)
    half, *digits = *first, last

    def erode(step: str) -> Callable[..., Sequence[Any]]:
        def write(above: Any, *before: Any) -> Sequence[Any]:
            digits = list(before)
            carried = add(builder, digits, _eroded(builder, place, step), _COUNT)
            above = builder.add(above, ones_of_words(builder, [carried]))
            # No digit changes, and none is carried, only where nothing is added.
            changed = [builder.xor(*both) for both in zip(before, digits, strict=True)]
            return is_any(builder, *changed, carried), above, *digits

        return write

    some = is_any(builder, half, *digits)
    above, *digits = repeat(builder, some, [_NOTHING, *digits], *map(erode, steps))
    carried = call(builder, "vector.reduce.add", WORD, above)
    return builder.add(worth_of(builder, [half, *digits]), builder.shl(carried, WORD(_HALVES + 1)))


def _eroded(builder: Any, place: Any, step: str) -> Iterator[Any]:
    """The vectors of an image one after the other, each eroded where it lies."""

    def level(rows: Any) -> Any:
        return builder.and_(rows, between_ones(builder, rows))

    first, last = _load(builder, place, 0), _load(builder, place, _COUNT - 1)
    above = moved(builder, _NOTHING, last, range(LANES - 1, 2 * LANES - 1))
    below = moved(builder, first, _NOTHING, range(1, LANES + 1))
    before, rows = above, first
    if step == "x":
        before, here = level(above), level(first)
    for at in range(_COUNT):
        following = _load(builder, place, at + 1) if at + 1 < _COUNT else below
        if step == "x":
            after = level(following)
            left = builder.and_(here, builder.and_(before, after))
            before, here = here, after
        else:
            left = builder.and_(level(rows), builder.and_(before, following))
            before, rows = rows, following
        _store(builder, left, place, at)
        yield left


def _load(builder: Any, place: Any, at: int) -> Any:
    return builder.load(builder.gep(place, [WORD(at)]), align=_BYTES)


def _store(builder: Any, rows: Any, place: Any, at: int) -> None:
    builder.store(rows, builder.gep(place, [WORD(at)]), align=_BYTES)
