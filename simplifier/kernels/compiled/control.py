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
