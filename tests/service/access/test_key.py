"""The form of a key: what a scanner of secrets needs to know."""

from __future__ import annotations

import binascii
import re
from collections.abc import Callable

import pytest

from service.access.key import may_be_key, new_secret, with_checksum
from tests.acceptance.command import ROOT

BASE_62 = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"


def value_of(digits: str) -> int:
    """Base 62, read as one reads a number."""
    value = 0
    for digit in digits:
        value = 62 * value + BASE_62.index(digit)
    return value


def test_a_key_ends_with_the_checksum_of_what_is_before() -> None:
    seen = set()
    for _ in range(200):
        secret = new_secret()
        assert re.fullmatch("occ_[0-9A-Za-z]{43}[0-9A-Za-z]{6}", secret)
        assert value_of(secret[-6:]) == binascii.crc32(secret[:-6].encode())
        assert may_be_key(secret)
        seen.add(secret)
    assert len(seen) == 200


def test_the_checksum_of_a_known_text() -> None:
    """CRC-32 of "123456789" is CBF43926 (the check of ITU-T V.42); leading zeros stay."""
    assert value_of(with_checksum("123456789")[9:]) == 0xCBF43926
    assert with_checksum("") == "000000"


def test_the_check_that_the_docs_give_to_scanners_is_right() -> None:
    page = (ROOT / "docs/security.md").read_text()
    [block] = re.findall(r"```python\n(import zlib.*?)```", page, re.DOTALL)
    told: dict[str, Callable[[str], bool]] = {}
    exec(block, told)
    secret = new_secret()
    assert told["is_key"](secret)
    assert not told["is_key"](secret[:-1] + ("a" if secret[-1] != "a" else "b"))
    [rule] = re.findall(r"`(occ_\[.*?)`", page)
    assert re.findall(rule, f'key = "{secret}"') == [secret]


def test_every_digit_counts() -> None:
    secret = new_secret()
    for place in range(4, len(secret)):
        for digit in "0Zz":
            if secret[place] != digit:
                assert not may_be_key(secret[:place] + digit + secret[place + 1 :])


def test_a_key_of_before_is_one() -> None:
    assert may_be_key("occ_k3J-_9fQ2mZ1x0YbLw8Vt6RsPqOnMlKjIhGfEdCbA-4")


@pytest.mark.parametrize(
    "text", ["", "occ_", "occ_none", "occ_" + "a" * 42, "occ_" + "a" * 44, "occ_" + "a" * 49,
             "ghp_" + "a" * 43, "occ_" + "a" * 42 + "\u0663", "occ_" + "a" * 43 + "\n"],
)  # fmt: skip
def test_what_is_no_key(text: str) -> None:
    assert not may_be_key(text)
