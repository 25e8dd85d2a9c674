"""What stands at a path: nothing where that cannot be told, as of a name that is too long or in a
folder that is closed.  Reading or writing there then says why; :class:`~pathlib.Path` raises."""

from __future__ import annotations

import os
from pathlib import Path


def is_file(path: Path) -> bool:
    """Whether it is a file, by a link or not."""
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: Path) -> bool:
    """Whether it is a folder, by a link or not."""
    return os.path.isdir(path)  # noqa: PTH112


def is_there(path: Path) -> bool:
    """Whether anything is there."""
    return os.path.exists(path)  # noqa: PTH110


def names_in(folder: Path) -> list[str]:
    """Of all that lies in a folder, in any order; in a tenth of the time of :meth:`Path.glob`."""
    try:
        return os.listdir(folder)  # noqa: PTH208
    except (OSError, ValueError):
        return []


def followed(path: Path) -> Path:
    """The absolute path that its links lead to; of those that lead in a circle, as it stands."""
    return Path(os.path.realpath(path))
