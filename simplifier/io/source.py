"""The bytes of an input file, or a refusal that says why there are none."""

from __future__ import annotations

import stat
from pathlib import Path

from simplifier.errors import UnreadableMeshError


def read_bytes(path: Path) -> bytes:
    """The whole file.

    Raises :class:`UnreadableMeshError` when it is missing, empty, forbidden, a folder, or a device
    or pipe (which might never end).
    """
    where = str(path)
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise UnreadableMeshError("this is a folder", where=where, remedy="name a mesh file")
        if not stat.S_ISREG(mode):
            raise UnreadableMeshError(
                "this is a device or a pipe", where=where, remedy="name a mesh file"
            )
        data = path.read_bytes()
    except FileNotFoundError:
        raise UnreadableMeshError(
            "there is no such file", where=where, remedy="check the path"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise UnreadableMeshError(
            f"the file cannot be read ({reason})", where=where, remedy="check its permissions"
        ) from None
    if not data:
        raise UnreadableMeshError(
            "the file is empty", where=where, remedy="copy or export it again"
        )
    return data
