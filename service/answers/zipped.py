"""Files of a job as one zip, put together while it is sent: no more than a chunk is ever held."""

from __future__ import annotations

import time
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath
from urllib.parse import quote

from fastapi.responses import Response

from service.answers.files import CheckedResponse, lost_file
from service.jobs.job import Job, JobFile
from service.jobs.stores import BlobStore

ZIP = "application/zip"

_CHUNK = 1 << 18  # bytes that are read, packed and sent at once
_FILE_MODE = 0o644 << 16
_UNSAFE = frozenset('<>:"/\\|?*')  # in names of files, on some system
_LONGEST = 100


def send_zip(blobs: BlobStore, job: Job, files: Sequence[JobFile]) -> Response:
    """The files by their names, in a folder that is named as what was sent.

    It is as long as it turns out to be: where bytes are gone or damaged the connection is broken
    off, so that the client sees that the end is missing.
    """
    stem = _safe(PurePosixPath(job.name).stem)
    headers = {
        "Content-Disposition": _disposition(f"{stem}_{job.kind}.zip"),
        # The next one may hold files that were made since.
        "Cache-Control": "private, no-cache",
    }
    return CheckedResponse(_zip_chunks(blobs, files, stem, job.created), 200, headers, ZIP)


class _Sink:
    """Where a zip is written to, which cannot go back: what comes is taken away at once."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def write(self, data: bytes) -> int:
        self._parts.append(bytes(data))
        return len(data)

    def flush(self) -> None:
        """Nothing waits here."""

    def taken(self) -> bytes:
        data = b"".join(self._parts)
        self._parts.clear()
        return data


def _zip_chunks(
    blobs: BlobStore, files: Sequence[JobFile], folder: str, created: float
) -> Iterator[bytes]:
    """The same files give the same bytes: their time is that of the job."""
    moment = time.gmtime(created)[:6]
    sink = _Sink()
    with zipfile.ZipFile(sink, "w") as archive:  # type: ignore[call-overload]
        for file in files:
            entry = zipfile.ZipInfo(f"{folder}/{file.name}", moment)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = _FILE_MODE
            entry.file_size = file.blob.size  # tells whether it needs 64 bits
            try:
                source = blobs.open(file.blob)
            except KeyError:
                raise lost_file(file) from None
            with source, archive.open(entry, "w") as target:
                while chunk := source.read(_CHUNK):
                    target.write(chunk)
                    if packed := sink.taken():
                        yield packed
    yield sink.taken()


def _safe(name: str) -> str:
    """A name of any text as that of a file on every system."""
    kept = "".join("_" if one in _UNSAFE or not one.isprintable() else one for one in name)
    return kept[:_LONGEST].strip(" .") or "job"


def _disposition(name: str) -> str:
    """RFC 6266: for old clients in ASCII, for all others as it is."""
    plain = name.encode("ascii", "replace").decode("ascii").replace("?", "_")
    return f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(name, safe='')}"
