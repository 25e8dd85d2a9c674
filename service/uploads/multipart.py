"""A body of ``multipart/form-data``, part by part as it comes: nothing is held back or spooled."""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum, auto

from python_multipart import MultipartParser
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import parse_options_header

from service.errors import BadRequestError

MEDIA_TYPE = b"multipart/form-data"
_MAX_PARTS = 16
_AS_IT_IS = frozenset({b"", b"binary", b"8bit", b"7bit"})
_REMEDY = "send multipart/form-data as RFC 7578 has it"


@dataclass(frozen=True)
class Part:
    """One part; ``filename`` and ``media_type`` are as its sender says, and may be empty.

    ``chunks`` must be read before the next part is asked for; what is left is skipped.
    """

    name: str
    filename: str
    media_type: str
    chunks: AsyncIterator[bytes]


def boundary_of(content_type: str) -> bytes | None:
    """What parts a body of this media type; None for one that is no ``multipart/form-data``.

    Raises :class:`BadRequestError` where it should be told and is not.
    """
    media_type, parameters = parse_options_header(content_type)
    if media_type != MEDIA_TYPE:
        return None
    boundary = parameters.get(b"boundary")
    if not boundary:
        raise BadRequestError("the Content-Type has no boundary", remedy=_REMEDY)
    return boundary


async def read_parts(boundary: bytes, body: AsyncIterator[bytes]) -> AsyncIterator[Part]:
    """Raises :class:`BadRequestError` for what is malformed or ends too soon, and as ``body``."""
    events = _Events(boundary, body)
    count = 0
    while (event := await events.next()) is not _End.BODY:
        if not isinstance(event, dict):
            continue
        count += 1
        if count > _MAX_PARTS:
            raise BadRequestError(f"there are more than {_MAX_PARTS} parts", remedy="send fewer")
        yield _part(event, events)
    async for _ in body:  # what comes after the last boundary counts for nothing
        pass


def _part(headers: _Headers, events: _Events) -> Part:
    _, disposition = parse_options_header(headers.get(b"content-disposition", b""))
    name = disposition.get(b"name", b"").decode(errors="replace")
    if not name:
        raise BadRequestError("a part has no name", remedy=_REMEDY)
    encoding = headers.get(b"content-transfer-encoding", b"").strip().lower()
    if encoding not in _AS_IT_IS:
        raise BadRequestError(
            f"the part '{name}' is sent as {encoding.decode(errors='replace')}",
            remedy="send the bytes as they are",
        )
    filename = disposition.get(b"filename", b"").decode(errors="replace")
    media_type = headers.get(b"content-type", b"").decode(errors="replace")
    return Part(name, filename, media_type, events.data())


class _End(Enum):
    PART = auto()
    BODY = auto()


_Headers = dict[bytes, bytes]
_Event = _Headers | bytes | _End


class _Events:
    """What the parser has found, in order: headers, data and the end of each part, then the end."""

    def __init__(self, boundary: bytes, body: AsyncIterator[bytes]) -> None:
        self._body = body
        self._found: deque[_Event] = deque()
        self._headers: _Headers = {}
        self._field = self._value = b""
        with _refusing_malformed():
            self._parser = MultipartParser(
                boundary,
                {
                    "on_part_begin": self._begin,
                    "on_header_field": self._on_field,
                    "on_header_value": self._on_value,
                    "on_header_end": self._on_header,
                    "on_headers_finished": lambda: self._found.append(self._headers),
                    "on_part_data": lambda data, a, b: self._found.append(data[a:b]),
                    "on_part_end": lambda: self._found.append(_End.PART),
                    "on_end": lambda: self._found.append(_End.BODY),
                },
            )

    async def next(self) -> _Event:
        while not self._found:
            chunk = await anext(self._body, None)
            if chunk is None:
                raise BadRequestError(
                    "the body ends before the boundary that closes it", remedy="send all of it"
                )
            with _refusing_malformed():
                self._parser.write(chunk)
        return self._found.popleft()

    async def data(self) -> AsyncIterator[bytes]:
        """The data of the part whose headers came last."""
        while isinstance(event := await self.next(), bytes):
            yield event

    def _begin(self) -> None:
        self._headers = {}

    def _on_field(self, data: bytes, begin: int, end: int) -> None:
        self._field += data[begin:end]

    def _on_value(self, data: bytes, begin: int, end: int) -> None:
        self._value += data[begin:end]

    def _on_header(self) -> None:
        self._headers[self._field.lower()] = self._value
        self._field = self._value = b""


@contextmanager
def _refusing_malformed() -> Iterator[None]:
    """Turn what the parser does not understand into :class:`BadRequestError`."""
    try:
        yield
    except FormParserError as error:
        raise BadRequestError(f"the body is malformed ({error})", remedy=_REMEDY) from None
