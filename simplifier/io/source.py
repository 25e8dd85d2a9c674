"""The bytes of an input file, or a refusal that says why there are none."""

from __future__ import annotations

import stat
from pathlib import Path

from simplifier.errors import OccluderError, UnreadableMeshError


def read_bytes(
    path: Path,
    *,
    error: type[OccluderError] = UnreadableMeshError,
    remedy: str = "name a mesh file",
) -> bytes:
    """The whole file.

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
        data = path.read_bytes()
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
