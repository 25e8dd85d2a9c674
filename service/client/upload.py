"""What is sent: a file, read as it goes, or bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

_CHUNK = 1 << 18

Tell = Callable[[float], None]
"""Called with the share of the upload that was sent, 0 to 1; what it raises ends the call."""


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
        """All of it from the begin, never more than a chunk in memory."""
        with self.open() as file:
            while chunk := file.read(_CHUNK):
                yield chunk


def told(chunks: Iterable[bytes], size: int, tell: Tell) -> Iterator[bytes]:
    """The chunks of so many bytes; after each the share that was sent by then is told."""
    sent = 0
    for chunk in chunks:
        yield chunk
        sent += len(chunk)
        tell(min(1.0, sent / size))
