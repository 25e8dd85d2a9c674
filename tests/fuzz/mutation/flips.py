"""Changes that any bytes can take."""

from __future__ import annotations

import struct
from random import Random

_WHOLE = (
    0,
    1,
    2,
    3,
    4,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    65536,
    2**31 - 1,
    2**31,
    2**32 - 1,
)
_REAL = (
    0.0, -0.0, 1.0, -1.0, 0.5, 5e-324, 1e-45, 1e-38, 3.4e38, 1e39, 1e100, 1e150, 1.7e308,
    float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
_LONGEST = 1 << 16


def flip(random: Random, data: bytes, other: bytes) -> bytes:
    """One small change; ``other`` is a second file to take a part of."""
    return random.choice(_CHANGES)(random, data, other)[:_LONGEST]


def _place(random: Random, data: bytes) -> int:
    return random.randrange(len(data) + 1)


def _run(random: Random, data: bytes) -> tuple[int, int]:
    """Where a run begins and ends: most are short."""
    begin = _place(random, data)
    length = random.choice((1, 2, 4, 12, 50, random.randint(0, max(len(data) // 2, 1))))
    return begin, min(begin + length, len(data))


def _bit(random: Random, data: bytes, other: bytes) -> bytes:
    if not data:
        return b"\0"
    changed = bytearray(data)
    changed[random.randrange(len(data))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _byte(random: Random, data: bytes, other: bytes) -> bytes:
    at = _place(random, data)
    return data[:at] + bytes([random.randrange(256)]) + data[at + 1 :]


def _number(random: Random, data: bytes, other: bytes) -> bytes:
    """A number at one of the edges, over what was there."""
    order = random.choice("<<<>")
    if random.random() < 0.4:
        kind = random.choice("fd")
        value = random.choice(_REAL)
        if kind == "f" and 3.5e38 < abs(value) < float("inf"):
            value = 3.4e38
        patch = struct.pack(order + kind, value)
    else:
        width = random.choice((1, 2, 4, 8))
        value = random.choice(_WHOLE) * random.choice((1, -1)) % 256**width
        patch = value.to_bytes(width, "little" if order == "<" else "big")
    at = _place(random, data)
    if random.random() < 0.7:  # where a number of that width is likely to stand
        at -= at % len(patch)
    return data[:at] + patch + data[at + len(patch) :]


def _cut_out(random: Random, data: bytes, other: bytes) -> bytes:
    begin, end = _run(random, data)
    return data[:begin] + data[end:]


def _cut_off(random: Random, data: bytes, other: bytes) -> bytes:
    return data[: _place(random, data)]


def _double(random: Random, data: bytes, other: bytes) -> bytes:
    begin, end = _run(random, data)
    times = random.choice((2, 2, 2, 8, 64))
    return data[:begin] + data[begin:end] * times + data[end:]


def _move(random: Random, data: bytes, other: bytes) -> bytes:
    begin, end = _run(random, data)
    rest = data[:begin] + data[end:]
    at = _place(random, rest)
    return rest[:at] + data[begin:end] + rest[at:]


def _fill(random: Random, data: bytes, other: bytes) -> bytes:
    begin, end = _run(random, data)
    return data[:begin] + bytes([random.choice((0, 255, 32, 48))]) * (end - begin) + data[end:]


def _splice(random: Random, data: bytes, other: bytes) -> bytes:
    return data[: _place(random, data)] + other[_place(random, other) :]


def _insert(random: Random, data: bytes, other: bytes) -> bytes:
    begin, end = _run(random, other)
    at = _place(random, data)
    return data[:at] + other[begin:end] + data[at:]


_CHANGES = (
    _bit, _bit, _byte, _byte, _number, _number, _number, _cut_out, _cut_off, _double, _move, _fill,
    _splice, _insert,
)  # fmt: skip
