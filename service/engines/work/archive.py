"""A zip from anyone to a folder, nothing outside of it, and no more than it may hold."""

from __future__ import annotations

import errno
import lzma
import re
import stat
import zipfile
import zlib
from pathlib import Path, PurePosixPath

import simplifier

_MOST_ENTRIES = 20_000
_CHUNK = 1 << 20
_REMEDY = "zip the folder again"
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError,
    ValueError,
)  # fmt: skip
# By the entries, not by the disk: clashing or overlong names, places before the file's begin; what
# decoders raise has no number.
_BY_ENTRIES = (
    None, errno.EINVAL, errno.ENAMETOOLONG, errno.EEXIST, errno.ENOTDIR, errno.EISDIR,
)  # fmt: skip
_DRIVE = re.compile(r"[A-Za-z]:")


def unpack(archive: Path, folder: Path, limit: int) -> None:
    """Write the files of an archive below an empty folder.

    Raises :class:`simplifier.UnreadableMeshError` for what is no zip, damaged or encrypted, for
    names that lead elsewhere, links, more than 20,000 entries, and more bytes than ``limit``: those
    that come out are counted, whatever the archive claims.
    """
    try:
        with zipfile.ZipFile(archive) as opened:
            entries = opened.infolist()
            if len(entries) > _MOST_ENTRIES:
                raise _refusal(
                    archive, f"it has {len(entries):,} entries", f"send at most {_MOST_ENTRIES:,}"
                )
            for entry in entries:
                limit -= _unpack_entry(opened, entry, _place(archive, entry, folder), limit)
    except _DAMAGE as error:
        raise _refusal(archive, f"it is no zip that can be read ({error})", _REMEDY) from None
    except OSError as error:
        if error.errno not in _BY_ENTRIES:
            raise
        reason = f"its entries cannot be unpacked ({error.strerror or error})"
        raise _refusal(archive, reason, _REMEDY) from None


def _place(archive: Path, entry: zipfile.ZipInfo, folder: Path) -> Path:
    """The place below the folder where an entry goes."""
    name = entry.filename.replace("\\", "/")
    parts = PurePosixPath(name).parts
    if name.startswith("/") or ".." in parts or _DRIVE.match(name) or not parts:
        raise _refusal(
            archive, f"its entry '{name[:80]}' lies outside of it", "use names within the folder"
        )
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise _refusal(archive, f"its entry '{name[:80]}' is a link or a device", "send files only")
    if entry.flag_bits & 1:
        raise _refusal(archive, f"its entry '{name[:80]}' is encrypted", "send it without password")
    return folder.joinpath(*parts)


def _unpack_entry(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, place: Path, limit: int) -> int:
    """Write one entry; how many bytes it had."""
    if entry.is_dir():
        place.mkdir(parents=True, exist_ok=True)
        return 0
    place.parent.mkdir(parents=True, exist_ok=True)
    size = 0
    with archive.open(entry) as source, place.open("xb") as target:
        while chunk := source.read(_CHUNK):
            size += len(chunk)
            if size > limit:
                raise _refusal(
                    Path(str(archive.filename)), "it unpacks to more than may be sent",
                    "leave out textures, or send fewer objects",
                )  # fmt: skip
            target.write(chunk)
    return size


def _refusal(archive: Path, what: str, remedy: str) -> simplifier.UnreadableMeshError:
    return simplifier.UnreadableMeshError(what, where=str(archive), remedy=remedy)
