"""Numbers from text files: the kernels of ``kernels/text.py`` with the hard words finished here."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from types import ModuleType

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray

_WORD = re.compile(rb"[^\s\\]+")
_COMMA = re.compile(rb"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")  # a decimal, in half of the world
# What Microsoft's C library prints for infinity and NaN: 1.#INF, -1.#IND, 1.#QNAN00.
_MICROSOFT = re.compile(rb"[+-]?1\.#(INF|IND|QNAN|SNAN)\d*", re.IGNORECASE)


def text_kernels() -> ModuleType:
    """Loaded, and compiled, only where a text is read."""
    from simplifier.kernels import text

    return text


@dataclass(frozen=True, eq=False)
class NumberLines:
    """All numbers of a text, with the line structure kept.

    ``values``  (n,) float64 in the order of the file.
    ``firsts``  (lines + 1,) int64: line k holds ``values[firsts[k]:firsts[k + 1]]``; lines without
                a word are left out.
    """

    values: FloatArray
    firsts: IndexArray


def without_mark(data: bytes) -> bytes:
    """The text without a UTF-8 byte order mark."""
    return data.removeprefix(b"\xef\xbb\xbf")


def quote_word(word: bytes) -> str:
    """A word of the file as it can be put into a message."""
    text = word[:24].decode("latin-1").encode("unicode_escape").decode("ascii")
    return f"'{text}…'" if len(word) > 24 else f"'{text}'"


def line_number(data: bytes, position: int) -> int:
    """The line, from 1, that holds the byte at ``position``."""
    feeds, returns, both = (data.count(end, 0, position) for end in (b"\n", b"\r", b"\r\n"))
    return 1 + feeds + returns - both


def read_numbers(data: bytes, where: str, *, begin: int = 0) -> NumberLines:
    """Every word from ``begin`` on as a number; comments after ``#`` are left out.

    Raises :class:`UnreadableMeshError` with the line of the first word that is no number.
    """
    text = np.frombuffer(data, dtype=np.uint8)
    words, lines = text_kernels().count_words(text, begin)
    values = np.empty(words)
    hard = np.empty(words, dtype=np.int64)
    firsts = np.full(lines + 1, words, dtype=np.int64)
    text_kernels().read_words(text, begin, values, hard, firsts)
    _finish(data, values, hard, where)
    return NumberLines(values, firsts)


def named_lines(data: bytes, keywords: Sequence[bytes]) -> Iterator[tuple[int, bytes, str]]:
    """Where each line that begins with one of the words begins, the word, and the rest as text.

    A line that a backslash joins to the one before is none.
    """
    line = rb"[ \t]*(" + b"|".join(map(re.escape, keywords)) + rb")[ \t]+([^\r\n]*)"
    # A pattern that begins with a line's end is found ten times as fast as one with a choice.
    for found in chain(filter(None, [re.match(line, data)]), re.finditer(rb"[\r\n]" + line, data)):
        before = found.start()
        if not data[max(before - 2, 0) : before].rstrip(b"\r\n").endswith(b"\\"):
            begin = before + (data[before] in b"\r\n")
            yield begin, found[1], found[2].strip().decode("utf-8", errors="replace")


def count_statements(data: bytes, keyword: bytes) -> int:
    """How many lines begin with the word ``keyword``, which is in lower case, in either case."""
    text, name = (np.frombuffer(part, dtype=np.uint8) for part in (data, keyword))
    return int(text_kernels().count_statements(text, name))


def read_statements(data: bytes, keyword: bytes, width: int, where: str) -> FloatArray:
    """(n, width) float64: the first numbers of each line that begins with the word ``keyword``.

    ``keyword`` is in lower case and matches either case.  Raises :class:`UnreadableMeshError` with
    the line that has fewer numbers or a word that is none.
    """
    text, name = (np.frombuffer(part, dtype=np.uint8) for part in (data, keyword))
    values = np.empty((count_statements(data, keyword), width))
    hard = np.empty(values.shape, dtype=np.int64)
    short = text_kernels().read_statements(text, name, values, hard)
    if short >= 0:
        raise UnreadableMeshError(
            f"line {line_number(data, short)}: '{keyword.decode()}' needs {width} numbers",
            where=where,
            remedy="the file is damaged; export it again",
        )
    _finish(data, values, hard, where)
    return values


def _finish(data: bytes, values: FloatArray, hard: IndexArray, where: str) -> None:
    """Convert, in place, the words that the kernel left over."""
    left = np.nonzero(hard.ravel() >= 0)[0]
    numbers: list[float] = []
    for position in hard.ravel()[left].tolist():
        match = _WORD.match(data, position)
        word = match.group() if match else data[position : position + 1]
        try:
            numbers.append(_number(word))
        except ValueError:
            raise UnreadableMeshError(
                f"line {line_number(data, position)}: {quote_word(word)} is not a number",
                where=where,
                remedy="write decimals with a point: export it in another locale"
                if _COMMA.fullmatch(word)
                else "the file is damaged; export it again",
            ) from None
    values.reshape(-1)[left] = numbers  # contiguous, so this is a view


def _number(word: bytes) -> float:
    if b"_" in word:  # Python's own digit grouping
        raise ValueError(word)
    try:
        return float(word)
    except ValueError:
        special = _MICROSOFT.fullmatch(word)
        if special is None:
            raise
        return float("inf") if special[1].upper() == b"INF" else float("nan")
