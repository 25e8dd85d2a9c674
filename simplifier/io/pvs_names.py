"""The names in a file of visible sets, each by what it has beyond the name before (front coding).

The offsets of groups of :data:`GROUP` names, then the names: how many bytes of the name before it
begins with, how many more it has (both LEB128), and these.  The first of a group begins with none,
so that a reader looks through one group alone, and no name is longer than its group bears out.
What a name adds is whole letters of UTF-8.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.pvs import leb128

GROUP = 16
_MOST_BYTES = 5  # of a number


def encode_names(names: Sequence[str]) -> tuple[NDArray[np.int64], bytes]:
    """Where each group begins, and the end; and the groups.

    What UTF-8 cannot write of a name becomes "?".
    """
    offsets, parts, size = [0], [], 0
    before = b""
    for index, name in enumerate(names):
        whole = name.encode("utf-8", "replace")
        shared = _shared(before, whole) if index % GROUP else 0
        part = leb128(shared) + leb128(len(whole) - shared) + whole[shared:]
        parts.append(part)
        size += len(part)
        if index % GROUP == GROUP - 1 or index == len(names) - 1:
            offsets.append(size)
        before = whole
    return np.array(offsets, dtype=np.int64), b"".join(parts)


def _shared(before: bytes, name: bytes) -> int:
    """How many bytes of whole letters both begin with."""
    most = min(len(before), len(name))
    count = next((at for at in range(most) if before[at] != name[at]), most)
    while _within_letter(before, count) or _within_letter(name, count):
        count -= 1
    return count


def _within_letter(text: bytes, place: int) -> bool:
    return place < len(text) and text[place] & 0xC0 == 0x80


def decode_names(offsets: NDArray[np.int64], text: bytes, count: int) -> tuple[str, ...]:
    """The names that :func:`encode_names` wrote.  Raises ValueError for what it does not write."""
    names: list[str] = []
    for begin, end in pairwise(offsets.tolist()):
        names += _group(text[begin:end], min(GROUP, count - len(names)))
    return tuple(names)


def _group(text: bytes, count: int) -> list[str]:
    names, at, before = [], 0, b""
    for _ in range(count):
        shared, at = _number(text, at)
        more, at = _number(text, at)
        if shared > len(before):
            raise ValueError(f"a name begins with {shared} bytes of one of {len(before)}")
        if more > len(text) - at:
            raise ValueError("a name ends behind its group")
        if _within_letter(before, shared):
            raise ValueError("a name begins with half a letter")
        text[at : at + more].decode()
        before = before[:shared] + text[at : at + more]
        names.append(before.decode())
        at += more
    if at < len(text):
        raise ValueError("a group of names goes on behind its names")
    return names


def _number(text: bytes, at: int) -> tuple[int, int]:
    """A number of LEB128, and what is behind it."""
    value = 0
    for place, byte in enumerate(text[at : at + _MOST_BYTES]):
        value |= (byte & 0x7F) << 7 * place
        if byte < 0x80:
            return value, at + place + 1
    raise ValueError("the length of a name goes on")
