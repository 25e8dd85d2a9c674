"""Control flow in LLVM's instructions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any


def merged(builder: Any, kind: Any, block: Any, value: Any) -> Any:
    """What has that value when control comes from that block; others are added."""
    found = builder.phi(kind)
    found.add_incoming(value, block)
    return found


def repeat(
    builder: Any, at_all: Any, before: Sequence[Any], *steps: Callable[..., Sequence[Any]]
) -> Sequence[Any]:
    """A loop over what changes from round to round; its values after the last one.

    ``at_all``  whether there is a first round.
    ``before``  the values that it begins with.
    ``steps``   write rounds in turn, which are given them; each returns whether another follows,
                and the values that it begins with.
    """
    ends = [(before, builder.basic_block)]
    begin, after = builder.append_basic_block("round"), builder.append_basic_block("after")
    builder.cbranch(at_all, begin, after)
    builder.position_at_end(begin)
    now = found = _merged_from(builder, ends)
    for place, step in enumerate(steps):
        again, *found = step(*found)
        ends.append((found, builder.basic_block))
        is_last = place == len(steps) - 1
        following = begin if is_last else builder.append_basic_block("round")
        builder.cbranch(again, following, after)
        builder.position_at_end(following)
    for value, last in zip(now, found, strict=True):
        value.add_incoming(last, ends[-1][1])
    builder.position_at_end(after)
    return _merged_from(builder, ends)


def _merged_from(builder: Any, ends: Sequence[tuple[Sequence[Any], Any]]) -> Sequence[Any]:
    """The values that control brings along from each of several blocks."""
    (values, block), *others = ends
    found = [merged(builder, value.type, block, value) for value in values]
    for more, block in others:
        for one, value in zip(found, more, strict=True):
            one.add_incoming(value, block)
    return found
