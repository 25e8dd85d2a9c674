"""A build in parts, which machines that know nothing of each other make: which assets are whose.

The shard of an asset depends on its name alone, so that machines agree whose meshes differ in time
or are not all there (docs/decisions/0036-shards-by-name.md).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from hashlib import sha256

from simplifier.errors import OptionError

MOST_SHARDS = 1_000_000
_FORM = re.compile(r"([0-9]{1,9})/([0-9]{1,9})")


@dataclass(frozen=True, order=True)
class Shard:
    """The ``number``-th of ``count``, from 1."""

    number: int
    count: int

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def holds(self, asset: str) -> bool:
        """Whether it makes an asset, by name."""
        return shard_number(asset, self.count) == self.number


def shard_number(asset: str, count: int) -> int:
    """From 1 to ``count``: the first eight bytes of SHA-256 of the name, big endian, modulo
    ``count``, plus 1."""
    digest = sha256(asset.encode(errors="surrogateescape")).digest()
    return int.from_bytes(digest[:8], "big") % count + 1


def read_shard(text: str) -> Shard:
    """Of ``2/16``.  Raises :class:`OptionError`."""
    found = _FORM.fullmatch(text)
    number, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= number <= count <= MOST_SHARDS:
        raise OptionError(
            f"'{text}' is not a shard",
            where="shard",
            remedy=f"write I/N, with I from 1 to N and N up to {MOST_SHARDS:,}, as in 2/16",
        )
    return Shard(number, count)
