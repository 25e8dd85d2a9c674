"""The header of a file of visible sets, and its refusals."""

from __future__ import annotations

from functools import partial

import numpy as np

from simplifier.errors import UnreadablePvsError
from simplifier.io.blocks import fitting

BLOCKS = (
    "order", "cells", "grid", "row_of", "row_offsets", "rows", "slices", "altitudes", "names",
)  # fmt: skip
HEADER = np.dtype([
    ("magic", "S8"), ("version", "<u4"), ("flags", "<u4"), ("file_bytes", "<u8"),
    ("objects", "<u4"), ("cells", "<u4"), ("rows", "<u4"), ("method", "<u4"), ("origin", "<f8", 3),
    ("low", "<f4", 3), ("high", "<f4", 3), ("blocks", [(name, "<u4") for name in BLOCKS]),
    ("scene", "V8"), ("settings", "V8"), ("checksum", "<u4"),
])  # fmt: skip


u32 = partial(fitting, where="visible sets", remedy="take fewer or larger view cells")


def damage(what: str, where: str) -> UnreadablePvsError:
    """The error of a file that is not as it was written."""
    return UnreadablePvsError(what, where=where, remedy="copy or write it again")
