"""The bytes of an input file, or a refusal that says why there are none."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

from simplifier.errors import OccluderError, UnreadableMeshError

_START = 1 << 16  # bytes


def read_bytes(
    path: Path,
    *,
    error: type[OccluderError] = UnreadableMeshError,
    remedy: str = "name a mesh file",
    check_start: Callable[[bytes, int], None] | None = None,
) -> bytes:
    """The whole file.

    ``check_start``  called with the first 64 KiB of a file that is not empty, and its size; where
                     it raises, no more of the file is read.

    Raises ``error`` when it is missing, empty, forbidden, a folder, or a device or pipe (which
    might never end); ``remedy`` says what to name in place of the last two.
    """
    where = str(path)
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise error("this is a folder", where=where, remedy=remedy)
        if not stat.S_ISREG(mode):
            raise error("this is a device or a pipe", where=where, remedy=remedy)
        with path.open("rb") as file:
            start = file.read(_START)
            if check_start and start:
                check_start(start, os.fstat(file.fileno()).st_size)
            file.seek(0)
            data = file.read()
    except FileNotFoundError:
        raise error("there is no such file", where=where, remedy="check the path") from None
    except (OSError, ValueError) as fault:  # ValueError: a NUL character in the name
        reason = getattr(fault, "strerror", None) or str(fault)
        raise error(
            f"the file cannot be read ({reason})", where=where, remedy="check its permissions"
        ) from None
    if not data:
        raise error("the file is empty", where=where, remedy="copy or export it again")
    return data
