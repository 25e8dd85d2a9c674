"""Files as answers: which one answers which ``Accept``, whole or in part, or not at all where the
asker has it.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Mapping

from anyio.to_thread import run_sync
from fastapi import Request
from fastapi.responses import Response, StreamingResponse
from starlette.types import Send

from service.errors import NotAcceptableError, NotFoundError, NotReadyError
from service.headers import ByteRange, best_of, is_fresh, wanted_range
from service.jobs.job import JobFile, JobKind
from service.jobs.stores import BlobStore, DamagedBlobError, Reader

_log = logging.getLogger(__name__)

_CHUNK = 1 << 16
"""Bytes that are read and sent at once.  Each slow reader holds three times as many."""
_LARGE_CHUNK = 1 << 18
"""The same for whoever has taken many chunks in a row within so little time each, more than the
system's buffers hold: going to a thread and back costs as much as hashing the smaller one."""
_QUICK_SECONDS = 0.01
_QUICK_IN_A_ROW = 128
_FOR_EVER = "private, max-age=31536000, immutable"
_SHOWN = ("image/", "text/html", "application/json")

JSON = "application/json"
HTML = "text/html"
FORMATS: Mapping[JobKind, Mapping[str, str]] = {
    JobKind.OCCLUDER: {
        "model/gltf-binary": "occluder.glb",
        "application/x-occluder": "occluder.occ",
        "model/obj": "lod0.obj",
        "model/ply": "lod0.ply",
        "application/ply": "lod0.ply",
        "model/stl": "lod0.stl",
        "model/off": "lod0.off",
        "application/x-godot-resource": "lod0.tres",
        HTML: "report.html",
    },
    JobKind.EVALUATION: {HTML: "report.html"},
    JobKind.SCENE: {"application/zip": "scene.zip", "model/gltf-binary": "preview.glb"},
    JobKind.TRADEOFF: {
        HTML: "tradeoff.html",
        "text/csv": "tradeoff.csv",
        "image/png": "tradeoff.png",
    },
    JobKind.VISIBILITY: {"application/x-pvs": "sets.pvs", "image/png": "cells.png"},
}
"""By kind of job and media type, the file; JSON comes before all of them.

A GLB and an OCC hold all levels of detail, the others the finest.
"""


def chosen_format(accept: str, kind: JobKind) -> str:
    """The media type to answer in.  Raises :class:`~service.errors.NotAcceptableError`."""
    offered = [JSON, *FORMATS[kind]]
    best = best_of(accept, offered)
    if best is None:
        raise NotAcceptableError(
            f"nothing can be given of '{accept}'", remedy=f"accept one of {', '.join(offered)}"
        )
    return best


def send_file(
    request: Request, blobs: BlobStore, file: JobFile, *, cache: str = _FOR_EVER
) -> Response:
    """The file, or what the request wants of it.  Call it in a thread: it opens the file.

    ``cache`` says how long it may be kept: for ever, unless the address may lead to another file
    later.  Raises :class:`~service.errors.RangeNotSatisfiableError`, and
    :class:`~service.errors.NotFoundError` where the bytes are gone.
    """
    etag = f'"{file.blob.digest}"'
    headers = {"ETag": etag, "Cache-Control": cache, "Accept-Ranges": "bytes"}
    if request.method in ("GET", "HEAD") and is_fresh(request.headers, etag):
        return Response(status_code=304, headers=headers)
    size = file.blob.size
    part = wanted_range(request.headers, etag, size) if request.method == "GET" else None
    sent = part or ByteRange(0, size)
    if part:
        headers["Content-Range"] = f"bytes {part.start}-{part.stop - 1}/{size}"
    headers["Content-Length"] = str(sent.stop - sent.start)
    headers["Content-Disposition"] = _disposition(file)
    status = 206 if part else 200
    if request.method == "HEAD":
        return Response(status_code=status, headers=headers, media_type=file.media_type)
    chunks = _chunks_of(_open_blob(blobs, file, sent))
    return CheckedResponse(chunks, status, headers, media_type=file.media_type)


def lead_to_file(blobs: BlobStore, file: JobFile) -> Response | None:
    """An answer that sends the asker to where the bytes are; None where only this service has them.

    Call it in a thread.  Raises :class:`~service.errors.NotFoundError` where the bytes are gone.
    """
    try:
        address = blobs.signed_url(file.blob, file.media_type, _disposition(file))
    except KeyError:
        raise lost_file(file) from None
    if address is None:
        return None
    return Response(status_code=307, headers={"Location": address, "Cache-Control": "no-store"})


class CheckedResponse(StreamingResponse):
    """Ends without its last bytes where they turn out to be damaged, or cannot be had: the server
    then breaks the connection off, and the client sees that less came than was announced.
    """

    async def stream_response(self, send: Send) -> None:
        try:
            await super().stream_response(send)
        except (DamagedBlobError, NotFoundError, NotReadyError) as error:
            _log.error("an answer was broken off: %s", error)


def read_file(blobs: BlobStore, file: JobFile) -> bytes:
    """All bytes of a small file of a job, known to be right.  Call it in a thread.

    Raises :class:`~service.errors.NotFoundError` where they are gone, or damaged.
    """
    try:
        with blobs.open(file.blob) as source:
            return source.read()
    except (KeyError, DamagedBlobError):
        raise lost_file(file) from None


def _open_blob(blobs: BlobStore, file: JobFile, part: ByteRange) -> Reader:
    try:
        return blobs.open(file.blob, part.start, part.stop)
    except KeyError:
        raise lost_file(file) from None


def lost_file(file: JobFile) -> NotFoundError:
    """Of a file whose bytes are gone."""
    return NotFoundError(f"'{file.name}' is no longer stored", remedy="make it again by a new job")


async def _chunks_of(source: Reader) -> AsyncIterator[bytes]:
    """The next one is read and hashed in a thread while the last one is sent."""
    quick = 0
    with source:
        ahead = asyncio.ensure_future(run_sync(source.read, _CHUNK))
        try:
            while chunk := await ahead:
                size = _LARGE_CHUNK if quick >= _QUICK_IN_A_ROW else _CHUNK
                ahead = asyncio.ensure_future(run_sync(source.read, size))
                began = time.monotonic()
                yield chunk
                quick = quick + 1 if time.monotonic() - began < _QUICK_SECONDS else 0
        finally:  # of whoever goes early too: the thread may be in the midst of a read
            await asyncio.gather(ahead, return_exceptions=True)


def _disposition(file: JobFile) -> str:
    shown = file.media_type.startswith(_SHOWN) and not file.is_input
    kind = "inline" if shown else "attachment"
    return f'{kind}; filename="{file.name.rpartition("/")[2]}"'
