"""One build of a folder at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simplifier.errors import OutputError

try:
    import fcntl
except ImportError:  # Windows: builds are not kept apart there
    fcntl = None  # type: ignore[assignment]


@contextmanager
def exclusive(folder: Path) -> Iterator[None]:
    """Hold the folder until the block ends, or the process in whatever way; it leaves no file.

    Raises :class:`OutputError` at once where another process holds it.
    """
    if fcntl is None:
        yield
        return
    try:
        held = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise OutputError(
            f"the folder cannot be opened ({error.strerror})",
            where=str(folder),
            remedy="check the path and its permissions",
        ) from None
    try:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OutputError(
                "another build of this folder is running",
                where=str(folder),
                remedy="wait for its end, or end it",
            ) from None
        yield
    finally:
        os.close(held)
