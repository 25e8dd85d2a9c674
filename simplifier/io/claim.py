"""What a file says that it holds, read from its beginning or from samples of it.

Each codec has a function from :class:`Peek` to :class:`Claim`.  Counts are held to what the file's
bytes can hold at all, so that a damaged one claims nothing absurd; reading tells what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_WINDOW = 1 << 16
_WINDOWS = 16  # of a long text, from its begin to its end


@dataclass(frozen=True)
class Claim:
    """``decoding``: bytes that are held at most until the arrays of the codec are there."""

    vertices: int
    triangles: int
    decoding: int


@dataclass(frozen=True)
class Peek:
    """A regular file of ``size`` bytes, of which only parts are read."""

    path: Path
    size: int

    def read(self, begin: int, count: int) -> bytes:
        """As many bytes as are there.  Raises OSError."""
        with self.path.open("rb") as file:
            file.seek(begin)
            # Python makes room for all that is asked for, there or not.
            return file.read(max(min(count, self.size - begin), 0))

    def samples(self) -> Iterator[bytes]:
        """The whole of a short file, else some windows spread evenly over it, whole lines each."""
        if self.size <= _WINDOWS * _WINDOW:
            yield self.read(0, self.size)
            return
        for number in range(_WINDOWS):
            window = self.read((self.size - _WINDOW) * number // (_WINDOWS - 1), _WINDOW)
            first, last = window.find(b"\n"), window.rfind(b"\n")
            yield window[first + 1 : last + 1] if 0 <= first < last else window


def estimate_matches(peek: Peek, pattern: re.Pattern[bytes]) -> tuple[int, int]:
    """How many matches a text has, and words in the group of all of them; exact for a short one."""
    seen = matches = words = 0
    for sample in peek.samples():
        seen += len(sample)
        for match in pattern.finditer(sample):
            matches += 1
            words += len(match[1].split())
    share = peek.size / max(seen, 1)
    return round(matches * share), round(words * share)
