"""Changes of packed scenes that get past their checksum: all else has to be checked."""

from __future__ import annotations

import struct
from random import Random

from tests.fuzz.mutation.flips import flip
from tests.io.damaged_occs import HEADER, signed


def flip_sealed(random: Random, data: bytes, other: bytes) -> bytes:
    """A small change with the length and the checksum of what comes of it."""
    changed = flip(random, data, other)
    if len(changed) < HEADER:
        return changed
    return signed(changed[:16] + struct.pack("<Q", len(changed)) + changed[24:])
