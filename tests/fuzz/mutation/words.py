"""Changes of text, whose words, numbers and lines stay whole."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

_WORD = re.compile(rb"[^\s,()\[\]{}:\"]+")
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\r|\n)?")
_NUMBERS = (
    b"0", b"-0", b"-0.0", b"1", b"-1", b"2", b"3", b"4", b"1e-320", b"1e-300", b"1e-45", b"1e38",
    b"1e39", b"1e149", b"1e150", b"1e308", b"-1e308", b"1e309", b"1e400", b"nan", b"-nan", b"inf",
    b"-inf", b"Infinity", b"1.#QNAN", b"-1.#INF", b"0x10", b"1_000", b"1,5", b"1.5.2", b"--1", b"+",
    b".", b"e", b"1e", b"1e+", b".5", b"5.", b"1d5", b"3.0000000000000001", b"255", b"256",
    b"65536",
    b"2147483647", b"2147483648", b"-2147483648", b"-2147483649", b"4294967296",
    b"9007199254740993", b"9223372036854775807", b"9223372036854775808", b"-9223372036854775809",
    b"18446744073709551616", b"9" * 40, b"0." + b"0" * 60 + b"1", b"1/1", b"1//1", b"1/", b"//",
)  # fmt: skip
_BLANKS = (b" ", b"\t", b"\n", b"\r", b"\r\n", b"\\\n", b"\0", b"#", b"\xc2\xa0", b"\x0b", b"\x0c")


def reword(random: Random, data: bytes, other: bytes) -> bytes:
    """One small change of a text, or of the text that is in a binary file."""
    return random.choice(_CHANGES)(random, data, other)


def _pick(random: Random, pattern: re.Pattern[bytes], data: bytes) -> tuple[int, int]:
    """Where one of the pattern's matches stands; nothing at the end where there is none."""
    spans = [match.span() for match in pattern.finditer(data)]
    return random.choice(spans) if spans else (len(data), len(data))


def _put(data: bytes, span: tuple[int, int], patch: bytes) -> bytes:
    return data[: span[0]] + patch + data[span[1] :]


def _renumber(random: Random, data: bytes, other: bytes) -> bytes:
    return _put(data, _pick(random, _NUMBER, data), random.choice(_NUMBERS))


def _nudge(random: Random, data: bytes, other: bytes) -> bytes:
    """A whole number one or two off: counts and indices."""
    begin, end = _pick(random, re.compile(rb"\b\d{1,9}\b"), data)
    value = int(data[begin:end] or b"0") + random.choice((-2, -1, 1, 2))
    return _put(data, (begin, end), str(value).encode())


def _swap(random: Random, data: bytes, other: bytes) -> bytes:
    one, two = sorted((_pick(random, _WORD, data), _pick(random, _WORD, data)))
    if one[1] > two[0]:
        return data
    words = data[slice(*one)], data[slice(*two)]
    return _put(_put(data, two, words[0]), one, words[1])


def _borrow(random: Random, data: bytes, other: bytes) -> bytes:
    word = other[slice(*_pick(random, _WORD, other))]
    return _put(data, _pick(random, _WORD, data), word)


def _blank(random: Random, data: bytes, other: bytes) -> bytes:
    return _put(data, _pick(random, re.compile(rb"\s+"), data), random.choice(_BLANKS))


def _line(change: Callable[[bytes], bytes]) -> Callable[[Random, bytes, bytes], bytes]:
    def changed(random: Random, data: bytes, other: bytes) -> bytes:
        span = _pick(random, _LINE, data)
        return _put(data, span, change(data[slice(*span)]))

    return changed


def _borrow_line(random: Random, data: bytes, other: bytes) -> bytes:
    at = _pick(random, _LINE, data)[0]
    return _put(data, (at, at), other[slice(*_pick(random, _LINE, other))])


_CHANGES = (
    _renumber, _renumber, _renumber, _nudge, _nudge, _swap, _borrow, _blank, _borrow_line,
    _line(lambda line: b""), _line(lambda line: line * 2), _line(lambda line: line * 40),
    _line(lambda line: line.upper()), _line(lambda line: line.rstrip(b"\r\n")),
)  # fmt: skip
