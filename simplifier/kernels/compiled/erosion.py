"""LLVM's instructions that measure 64 x 64 bit images, in vector registers while they are eroded.

Kept in memory, each erosion would read rows that the one before has just written, eight at a time
and from other places: the processor waits for that longer than it computes.  Where registers are
shorter than an eighth of an image, the compiler keeps parts in memory, which takes as long as a
loop over the rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

from simplifier.kernels.compiled.control import merged, repeat
from simplifier.kernels.compiled.counting import ones_of, ones_of_words
from simplifier.kernels.compiled.lanes import WORD, call, constant, moved
from simplifier.kernels.compiled.processors import Processor
from simplifier.kernels.compiled.rows import (
    EIGHT,
    NOTHING,
    ROWS,
    Vectors,
    all_but_one,
    between_ones,
    is_any,
    load_image,
    place_of,
)
from simplifier.kernels.compiled.turned_erosion import measure_turned

_ONE = constant(ROWS, 1)


def write_measure(builder: Any, address: Any, steps: str) -> Any:
    """Twice the measure of the 64 words at an address, as :func:`~..bit_image.measure_twice` says.

    ``steps`` are crosses ``+`` and squares ``x`` in turn.
    """
    return _measures(builder, [load_image(builder, address)], steps)[0]


def write_score(
    builder: Any, steps: str, unit: int, union: Any, original: Any, price: Any, fine: Any
) -> Any:
    """As :func:`~..soup_views.score_view` says."""
    whole = load_image(builder, union)
    return _score(builder, steps, unit, whole, original, price, fine)


def write_score_of_exchange(
    builder: Any, steps: str, unit: int, layers: Any, height: Any, old: Any, new: Any,
    original: Any, price: Any, fine: Any,
) -> Any:  # fmt: skip
    """As :func:`~..soup_views.score_exchange` says."""
    images = (layers, place_of(builder, layers, height), old, new)
    whole = [
        builder.or_(all_but_one(builder, one, two, own), added)
        for one, two, own, added in zip(*(load_image(builder, at) for at in images), strict=True)
    ]
    return _score(builder, steps, unit, whole, original, price, fine)


def _score(
    builder: Any, steps: str, unit: int, whole: Vectors, original: Any, price: Any, fine: Any
) -> Any:
    """Of what the original and the union ``whole`` show."""
    there = load_image(builder, original)
    part = [builder.and_(rows, others) for rows, others in zip(whole, there, strict=True)]
    beside = [builder.xor(rows, inside) for rows, inside in zip(whole, part, strict=True)]
    within, beyond = (builder.append_basic_block(name) for name in ("within", "beyond"))
    scored = builder.append_basic_block("scored")
    builder.cbranch(is_any(builder, *beside), beyond, within)

    builder.position_at_end(within)
    all_right = builder.mul(WORD(unit), _measures(builder, [whole], steps)[0])
    within = builder.basic_block
    builder.branch(scored)

    builder.position_at_end(beyond)
    both, right = _measures(builder, [whole, part], steps)
    worth = builder.mul(WORD(unit), right)
    worth = builder.sub(worth, builder.mul(price, builder.sub(both, right)))
    worth = builder.sub(worth, builder.mul(fine, ones_of(builder, beside)))
    beyond = builder.basic_block
    builder.branch(scored)

    builder.position_at_end(scored)
    score = merged(builder, WORD, within, all_right)
    score.add_incoming(worth, beyond)
    return score


def _measures(builder: Any, images: Sequence[Vectors], steps: str) -> Sequence[Any]:
    """Twice the measure of each of several images, of which the first holds all others.

    A loop over ``steps`` that ends with the first image in which nothing is left.
    """
    if not Processor.chosen().counts_ones:
        return [measure_turned(builder, image, steps) for image in images]
    count = len(images)

    def erode(step: str) -> Callable[..., Sequence[Any]]:
        def write(*values: Any) -> Sequence[Any]:
            so_far, rows = values[:count], values[count:]
            eroded = [
                _eroded(builder, rows[EIGHT * one : EIGHT * (one + 1)], step)
                for one in range(count)
            ]
            left = [ones_of_words(builder, image) for image in eroded]
            areas = [builder.add(*both) for both in zip(so_far, left, strict=True)]
            return is_any(builder, left[0]), *areas, *chain(*eroded)

        return write

    firsts = [ones_of_words(builder, image) for image in images]
    begun = [*[NOTHING] * count, *chain(*images)]
    totals = repeat(builder, is_any(builder, firsts[0]), begun, *map(erode, steps))[:count]
    twice = [builder.add(first, builder.shl(total, _ONE))
             for first, total in zip(firsts, totals, strict=True)]  # fmt: skip
    return [call(builder, "vector.reduce.add", WORD, rows) for rows in twice]


def _eroded(builder: Any, image: Vectors, step: str) -> Vectors:
    above, below = range(EIGHT - 1, 2 * EIGHT - 1), range(1, EIGHT + 1)
    framed = [NOTHING, *image, NOTHING]
    result = []
    for before, rows, after in zip(framed, image, framed[2:], strict=False):
        upright = builder.and_(
            moved(builder, before, rows, above), moved(builder, rows, after, below)
        )
        if step == "x":
            rows, upright = builder.and_(rows, upright), rows
        level = between_ones(builder, rows)
        result.append(builder.and_(rows, builder.and_(upright, level)))
    return result
