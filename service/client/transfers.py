"""Files on the wire: sent as they are read, and fetched whole and as announced, or not at all."""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import httpx

from service.client.errors import damaged_answer
from service.client.sending import Build, Sender

_CHUNK = 1 << 18

ReportShare = Callable[[float], None]
"""Called with the share of the upload that was sent, 0 to 1; what it raises ends the call."""

_DOWNLOAD_TRIES = 4


@dataclass(frozen=True)
class Upload:
    """Bytes and the name whose suffix says their format, unless their media type does."""

    source: Path | bytes
    name: str
    media_type: str | None = None

    @classmethod
    def of(
        cls, source: Path | bytes, name: str | None = None, media_type: str | None = None
    ) -> Upload:
        """Raises ValueError for bytes without a name, and OSError for a file that is not there."""
        if isinstance(source, Path):
            with source.open("rb"):  # what cannot be read is said before anything is sent
                return cls(source, name or source.name, media_type)
        if name is None:
            raise ValueError("bytes need a name, whose suffix says their format")
        return cls(source, name, media_type)

    @property
    def size(self) -> int:
        return self.source.stat().st_size if isinstance(self.source, Path) else len(self.source)

    def open(self) -> BinaryIO:
        return self.source.open("rb") if isinstance(self.source, Path) else BytesIO(self.source)

    def chunks(self) -> Iterator[bytes]:
        """All bytes from the begin, never more than a chunk of them in memory."""
        with self.open() as file:
            while chunk := file.read(_CHUNK):
                yield chunk


def report_as_read(chunks: Iterable[bytes], size: int, tell: ReportShare) -> Iterator[bytes]:
    """The chunks of so many bytes; after each the share that was sent by then is told."""
    sent = 0
    for chunk in chunks:
        yield chunk
        sent += len(chunk)
        tell(min(1.0, sent / size))


def download(sender: Sender, build: Build, target: Path) -> None:
    """Write what is answered beside the target and rename, once its SHA-256 is that of its ETag."""
    draft = target.with_name(f".occluder-{secrets.token_hex(8)}.tmp")
    try:
        _fill(sender, build, draft)
        draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)


def _fill(sender: Sender, build: Build, draft: Path) -> None:
    for _ in range(_DOWNLOAD_TRIES):
        with closing(sender.send(build, stream=True)) as response:
            announced = response.headers.get("ETag", "").removeprefix("W/").strip('"')
            try:
                found = _write(sender, response, draft)
            except httpx.TransportError:
                continue
        if found == announced:
            return
    raise damaged_answer(f"{response.url} did not arrive as announced, {_DOWNLOAD_TRIES} times")


def _write(sender: Sender, response: httpx.Response, draft: Path) -> str:
    """Write the body; its SHA-256 in hex."""
    digest = hashlib.sha256()
    with draft.open("wb") as file:
        for chunk in response.iter_bytes():
            sender.check()
            digest.update(chunk)
            file.write(chunk)
    return digest.hexdigest()
