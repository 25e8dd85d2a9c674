"""From a request's body to blobs: as it is, or in parts, never held in memory or spooled."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import AsyncIterator, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from starlette.requests import Request

from service.errors import (
    BadRequestError,
    FieldError,
    InvalidOptionsError,
    ServiceError,
    TooLargeError,
    UnreadableMeshError,
    UnsupportedMediaTypeError,
)
from service.jobs.job import Blob, JobFile
from service.jobs.media_types import media_type_of, suffix_of
from service.jobs.stores import Keeping
from service.settings import Settings
from service.uploads.body import Body
from service.uploads.multipart import Part, boundary_of, read_parts

TEXTS = ("options", "asset", "webhook", "priority", "keep")
"""Parts that are text."""
_LONGEST_TEXT = 64 << 10

_LONGEST_LABEL = 200
_LONGEST_SUFFIX = 20
# Control, format (bidirectional controls among them), surrogate, line and paragraph separators.
_UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})


@dataclass(frozen=True)
class Wanted:
    """A file that a request has to bring, or may.

    ``name``      of its part; ``what`` it is, for the docs.
    ``suffixes``  of the formats that may come.
    ``needed``    whether a request without it is refused.
    ``largest``   bytes that it may have; None for as many as any upload.
    ``fault``     what an empty one is refused by.
    """

    name: str
    suffixes: Collection[str]
    what: str = ""
    needed: bool = True
    largest: int | None = None
    fault: type[ServiceError] = UnreadableMeshError


@dataclass(frozen=True)
class UploadedFile:
    """A file that came.

    ``name``    of its part.
    ``label``   what its sender calls it, for people only.
    ``suffix``  of its format, with the dot, in lower case.
    """

    name: str
    label: str
    suffix: str
    blob: Blob

    @property
    def job_file(self) -> JobFile:
        """The file as an input of a job, by a name of ours."""
        name = f"input/{self.name}{self.suffix}"
        return JobFile(name, self.blob, media_type_of(name), is_input=True, label=self.label)


@dataclass(frozen=True)
class Uploads:
    """What a request brought: all files that it had to and others that it may, and texts."""

    files: Mapping[str, UploadedFile]
    texts: Mapping[str, str]


async def receive(
    request: Request, keeping: Keeping, wanted: Sequence[Wanted], settings: Settings
) -> Uploads:
    """Store the files of a request while they come.

    A body that is not ``multipart/form-data`` is the one file needed; its format is said by the
    query's ``filename``, or else by the media type.  Raises :class:`~service.errors.ServiceError`,
    after which the connection is closed where the client might go on sending, and
    ClientDisconnect.  What was stored by then is not named by any row, and a sweep removes it.
    """
    body: Body | None = None
    try:
        body = Body(request, settings)
        boundary = boundary_of(request.headers.get("content-type", ""))
        if boundary is None:
            return await _one_file(request, body, keeping, wanted)
        return await _parts(boundary, body, keeping, wanted)
    except ServiceError as error:
        if body is None or not body.ended:
            error.headers["Connection"] = "close"
        raise


async def _one_file(
    request: Request, body: Body, keeping: Keeping, wanted: Sequence[Wanted]
) -> Uploads:
    needed = [one for one in wanted if one.needed]
    if len(needed) > 1:
        names = " and ".join(f"'{one.name}'" for one in needed)
        raise UnsupportedMediaTypeError(
            f"the body is one file, and {names} are needed", remedy="send multipart/form-data"
        )
    part = Part(
        needed[0].name,
        request.query_params.get("filename", ""),
        request.headers.get("content-type", ""),
        body.chunks(),
    )
    return Uploads({part.name: await _store(part, needed[0], keeping)}, {})


async def _parts(
    boundary: bytes, body: Body, keeping: Keeping, wanted: Sequence[Wanted]
) -> Uploads:
    by_name = {one.name: one for one in wanted}
    files: dict[str, UploadedFile] = {}
    texts: dict[str, str] = {}
    async for part in read_parts(boundary, body.chunks()):
        if part.name in files or part.name in texts:
            raise BadRequestError(f"the part '{part.name}' comes twice", remedy="send it once")
        if part.name in by_name:
            files[part.name] = await _store(part, by_name[part.name], keeping)
        elif part.name in TEXTS:
            texts[part.name] = await _text(part)
        else:
            known = ", ".join([*by_name, *TEXTS])
            raise InvalidOptionsError(
                [FieldError(part.name, "there is no such part", f"the parts are {known}")]
            )
    for one in wanted:
        if one.needed and one.name not in files:
            raise BadRequestError(
                f"there is no part '{one.name}'", remedy="send the file as that part"
            )
    return Uploads(files, texts)


async def _store(part: Part, wanted: Wanted, keeping: Keeping) -> UploadedFile:
    label = file_label(part.filename)
    suffix = _suffix(label, part.media_type, wanted.suffixes)
    blob = await keeping.put_stream(_chunks_within_limit(part, wanted))
    if not blob.size:
        raise wanted.fault(f"the {part.name} file is empty", remedy="send a file with bytes in it")
    return UploadedFile(part.name, label or f"{part.name}{suffix}", suffix, blob)


async def _chunks_within_limit(part: Part, wanted: Wanted) -> AsyncIterator[bytes]:
    """Its bytes; raises :class:`TooLargeError`."""
    size = 0
    async for chunk in part.chunks:
        size += len(chunk)
        if wanted.largest is not None and size > wanted.largest:
            raise TooLargeError(
                f"the part '{part.name}' may have {wanted.largest:,} bytes, and this one has more",
                remedy="send a shorter one",
            )
        yield chunk


def _suffix(label: str, media_type: str, suffixes: Collection[str]) -> str:
    """The suffix of the format; raises :class:`UnsupportedMediaTypeError`."""
    by_label = PurePosixPath(label).suffix.lower()
    suffix = by_label if by_label in suffixes else suffix_of(media_type, suffixes)
    if suffix is None:
        said = [f"the name '{label}'"] if label else []
        said += [f"the media type '{media_type}'"] if media_type else []
        formats = ", ".join(f"{one} ({media_type_of(f'file{one}')})" for one in sorted(suffixes))
        raise UnsupportedMediaTypeError(
            f"no format that can be read is told by {' or '.join(said) or 'the request'}",
            remedy=f"give a file name or a media type of these: {formats}",
        )
    return suffix


async def _text(part: Part) -> str:
    text = bytearray()
    async for chunk in part.chunks:
        text += chunk
        if len(text) > _LONGEST_TEXT:
            raise TooLargeError(
                f"the part '{part.name}' has more than {_LONGEST_TEXT:,} bytes",
                remedy="files go into parts of their own",
            )
    try:
        return text.decode()
    except UnicodeDecodeError:
        raise BadRequestError(
            f"the part '{part.name}' is not UTF-8", remedy="encode it so"
        ) from None


def file_label(name: str) -> str:
    """The last step of a path of any system, without what cannot be seen, at most 200 characters.

    What is too long loses the end of its stem.  Empty where nothing is left.
    """
    last = re.split(r"[/\\]", name)[-1]
    label = "".join(one for one in last if unicodedata.category(one) not in _UNSEEN).strip()
    if not label.strip("."):
        return ""
    suffix = PurePosixPath(label).suffix
    if len(label) <= _LONGEST_LABEL or len(suffix) > _LONGEST_SUFFIX:
        return label[:_LONGEST_LABEL]
    return label[: _LONGEST_LABEL - len(suffix)] + suffix
