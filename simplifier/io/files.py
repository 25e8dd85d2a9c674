"""Files that appear whole or not at all, and the folders that they go to.

The bytes of an input file, or a refusal that says why there are none.
"""

from __future__ import annotations

import errno
import fnmatch
import os
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from simplifier.errors import OccluderError, OutputError, UnreadableMeshError
from simplifier.io.places import followed, is_file, is_folder, is_there, names_in

_DRAFT = ".occluder-*.tmp"


def check_folder(path: Path) -> None:
    """Raise :class:`OutputError` when the folder that ``path`` would be written to is not there,
    the system refuses the name, or what is there is no file."""
    if not is_folder(followed(path).parent):
        raise _no_folder(path)
    with _output_errors(path), suppress(FileNotFoundError):
        path.lstat()
    _check_replaceable(path)


def _check_replaceable(path: Path) -> None:
    if is_there(path) and not is_file(path):
        raise OutputError("this is a folder or a device", where=str(path), remedy="name a file")


def check_apart(paths: Iterable[Path], purpose: str, others: Iterable[tuple[Path, str]]) -> None:
    """Raise :class:`OutputError` where one of some ``paths`` is one of some ``others``, by a link
    or not: what is read or written besides is not to be lost by a slip of the keyboard.

    ``purpose``  what is to be written, as "the report"; with each other what it is.
    """
    places = {followed(path): path for path in paths}
    for other, what in others:
        path = places.get(followed(other))
        if path is not None:
            raise OutputError(
                f"this is {what}", where=str(path), remedy=f"name another file for {purpose}"
            )


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
    write_all_whole({path: data})


def write_all_whole(files: Mapping[Path, bytes]) -> None:
    """As :func:`write_whole`, several: none is replaced before all are written beside the targets.

    What can go wrong after that is that the folder changes meanwhile.
    """
    drafts: list[tuple[Path, Path]] = []
    try:
        for path, data in files.items():
            with _output_errors(path):
                drafts.append(_write_draft(path, data))
        for path, (draft, target) in zip(files, drafts, strict=True):
            with _output_errors(path):
                draft.replace(target)
    finally:
        for draft, _ in drafts:
            with suppress(OSError):
                draft.unlink(missing_ok=True)


def _write_draft(path: Path, data: bytes) -> tuple[Path, Path]:
    """Write the data beside the target; that file and the target."""
    target = followed(path)
    _check_replaceable(path)
    draft = target.with_name(_DRAFT.replace("*", os.urandom(8).hex()))
    try:
        draft.write_bytes(data)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    return draft, target


@contextmanager
def _output_errors(path: Path) -> Iterator[None]:
    """Turn what the system refuses into :class:`OutputError`."""
    try:
        yield
    except FileNotFoundError:
        raise _no_folder(path) from None
    except (OSError, ValueError, RuntimeError) as error:  # no right, a full disk, NUL, link loops
        reason = getattr(error, "strerror", None) or str(error)
        too_long = getattr(error, "errno", None) == errno.ENAMETOOLONG
        raise OutputError(
            f"the file cannot be written ({reason})",
            where=str(path),
            remedy="name a shorter one"
            if too_long
            else "check the folder's permissions and the free space",
        ) from None


def remove_drafts(folder: Path, *, idle: float = 0.0) -> None:
    """Delete what killed processes were writing into a folder.

    ``idle``  seconds for which a draft has to be as it is: more than 0 where other processes may
              be writing there.
    """
    for name in fnmatch.filter(names_in(folder), _DRAFT):
        draft = folder / name
        with suppress(OSError):  # its writer was quicker
            if max(0.0, time.time() - draft.stat().st_mtime) >= idle:
                draft.unlink()


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
        with path.open("rb", buffering=0) as file:
            if check_start:
                start = file.read(_START)
                if start:
                    check_start(start, os.fstat(file.fileno()).st_size)
                file.seek(0)
            data = file.readall()
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
