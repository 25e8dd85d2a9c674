"""Files that appear whole or not at all, and the folders that they go to."""

from __future__ import annotations

import secrets
from pathlib import Path

from simplifier.errors import OutputError

_DRAFT = ".occluder-*.tmp"


def check_folder(path: Path) -> None:
    """Raise :class:`OutputError` when the folder that ``path`` would be written to is not there."""
    if not path.resolve().parent.is_dir():
        raise _no_folder(path)


def make_folder(place: Path) -> None:
    """Make a folder to write to, and those above it; raise :class:`OutputError` where it cannot."""
    try:
        place.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(
            f"the folder cannot be made ({reason})", where=str(place), remedy="choose another one"
        ) from None


def _no_folder(path: Path) -> OutputError:
    return OutputError(
        f"there is no folder '{path.parent}'", where=str(path), remedy="create it first"
    )


def write_whole(path: Path, data: bytes) -> None:
    """Write beside the target and rename, which is atomic within a folder; a link is followed.

    An old file stays until then.  Raises :class:`OutputError` when the folder is not there or
    cannot be written, the target is no file, or the disk is full; nothing is left behind.
    """
    try:
        target = path.resolve()
        if target.exists() and not target.is_file():
            raise OutputError("this is a folder or a device", where=str(path), remedy="name a file")
        draft = target.with_name(_DRAFT.replace("*", secrets.token_hex(8)))
        try:
            draft.write_bytes(data)
            draft.replace(target)
        finally:
            draft.unlink(missing_ok=True)
    except FileNotFoundError:
        raise _no_folder(path) from None
    except (OSError, ValueError, RuntimeError) as error:  # no right, a full disk, NUL, link loops
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(
            f"the file cannot be written ({reason})",
            where=str(path),
            remedy="check the folder's permissions and the free space",
        ) from None


def remove_drafts(folder: Path) -> None:
    """Delete what killed processes were writing into a folder that no other process writes to."""
    for draft in folder.glob(_DRAFT):
        draft.unlink(missing_ok=True)
