"""A place in a bucket of an S3 server: objects by their keys.

All that is asked of a server is to put, get, list and delete objects, and to take large ones in
parts.  Requests are tried again for some time, so that a server that is busy for seconds is not
noticed.  One that stays away is: who asks then is told at once, after a look once a second, and not
after the time of all tries.

Credentials, region and endpoint are those of the ``AWS_*`` variables, as obstore reads them.
"""

from __future__ import annotations

import logging
import os
import re
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING
from urllib.parse import urlsplit
from xml.etree import ElementTree

import httpx
import obstore
from obstore.exceptions import BaseError
from obstore.store import S3Store

from service.errors import DiskFullError, NotReadyError, ServiceError, SettingsError
from service.storage.blobs.bucket_faults import (
    code_of,
    in_words,
    is_beyond,
    is_full,
    settings_fault,
    status_of,
)
from service.storage.blobs.signing import signed_address

if TYPE_CHECKING:
    from obstore import HTTP_METHOD
    from obstore.store import ClientConfig, ObjectStore, RetryConfig, S3Config

IDENTITY = "identity"
"""The key of the object that says whose the bucket is; all others are 32 hexadecimal digits."""

_KEY = re.compile(r"[0-9a-f]{32}")
_IN_FLIGHT = 2
"""Parts of an object that are sent at once."""
_PATIENCE = timedelta(seconds=25)
"""For which a request is tried again."""
_GLANCE = 1.0
"""Seconds between looks at whether a server that was away is there again."""
_SIGNED_SECONDS = 60
_UNKNOWN_CALL = (400, 405, 501)

_PATIENT_CLIENT: ClientConfig = {
    "allow_http": True,  # :meth:`Bucket.open` sees to it
    "connect_timeout": timedelta(seconds=5),
    "timeout": timedelta(seconds=90),  # of a part
}
_BRIEF_CLIENT: ClientConfig = {
    "allow_http": True,
    "connect_timeout": timedelta(seconds=3),
    "timeout": timedelta(seconds=5),
}
_PATIENT_RETRY: RetryConfig = {
    "max_retries": 1000,
    "retry_timeout": _PATIENCE,
    "backoff": {
        "init_backoff": timedelta(milliseconds=100),
        "max_backoff": timedelta(seconds=2),
        "base": 2,
    },
}
_BRIEF_RETRY: RetryConfig = {"max_retries": 0, "retry_timeout": timedelta(seconds=5)}

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Address:
    """``s3://bucket/prefix``; the prefix may be empty."""

    bucket: str
    prefix: str

    @classmethod
    def of(cls, url: str) -> Address:
        bucket, _, prefix = url.removeprefix("s3://").partition("/")
        return cls(bucket, prefix.strip("/"))

    def __str__(self) -> str:
        return f"s3://{self.bucket}/{self.prefix}".rstrip("/")


class Bucket:
    """Objects below a prefix of a bucket.  Safe from any thread.

    Raises KeyError for what is not there, :class:`~service.errors.NotReadyError` where the server
    does not do what it is asked, and :class:`~service.errors.DiskFullError` where it has no room.
    """

    def __init__(
        self,
        address: Address,
        patient: ObjectStore,
        brief: ObjectStore,
        one_by_one: ObjectStore,
    ) -> None:
        """``patient`` tries again for long, and so does ``one_by_one``, which deletes so; ``brief``
        never does."""
        self.address = address
        self._patient, self._brief, self._one_by_one = patient, brief, one_by_one
        self._lock = threading.Lock()
        self._away = False  # as far as was tried
        self._seen: str | None = None
        self._looked = float("-inf")
        self._bulk = False  # unless the server knows how

    @classmethod
    def open(cls, url: str) -> Bucket:
        """Raises :class:`~service.errors.SettingsError`; nothing is asked of the server yet."""
        endpoint = os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL", "")
        allowed = os.environ.get("AWS_ALLOW_HTTP", "").lower() in ("1", "true", "yes", "on")
        if urlsplit(endpoint).scheme == "http" and not allowed:
            raise SettingsError(
                f"AWS_ENDPOINT_URL is '{endpoint}', over which anybody between could read and "
                "change what is stored; use https, or set AWS_ALLOW_HTTP=true where nobody is"
            )
        address = Address.of(url)
        try:
            patient = _store(address, _PATIENT_CLIENT, _PATIENT_RETRY)
            one_by_one = _store(address, _PATIENT_CLIENT, _PATIENT_RETRY, bulk=False)
            brief = _store(address, _BRIEF_CLIENT, _BRIEF_RETRY)
        except (BaseError, ValueError) as error:
            told = str(error).partition("\n")[0]
            raise SettingsError(
                f"the AWS_* variables cannot be used ({told}); correct them"
            ) from error
        return cls(address, patient, brief, one_by_one)

    # Objects.

    def put(self, key: str, data: bytes | bytearray) -> None:
        """In one request."""
        with self._asking():
            obstore.put(self._patient, key, data, use_multipart=False)

    def put_parts(self, key: str, parts: Iterator[bytes | bytearray], size: int) -> None:
        """In parts of ``size`` bytes, of which the last may be shorter.

        What the iterator raises passes through, after the server was told to drop what came.
        """
        with self._asking():
            obstore.put(self._patient, key, parts, chunk_size=size, max_concurrency=_IN_FLIGHT)

    async def put_async(self, key: str, data: bytes | bytearray) -> None:
        """As :meth:`put`; whether the server is there was asked before, by :meth:`check_there`."""
        with self._translating():
            await obstore.put_async(self._patient, key, data, use_multipart=False)

    async def put_parts_async(
        self, key: str, parts: AsyncIterator[bytes | bytearray], size: int
    ) -> None:
        """As :meth:`put_parts`, likewise.  Not to be cancelled, or the parts stay for long."""
        with self._translating():
            await obstore.put_async(
                self._patient, key, parts, chunk_size=size, max_concurrency=_IN_FLIGHT
            )

    def get(self, key: str, start: int, stop: int) -> memoryview:
        """Bytes from ``start`` to before ``stop``, or fewer where the object ends before."""
        with self._asking():
            try:
                return memoryview(obstore.get_range(self._patient, key, start=start, end=stop))
            except BaseError as error:
                if is_beyond(str(error)):
                    return memoryview(b"")
                raise

    def delete(self, keys: Sequence[str]) -> None:
        """Those that are there."""
        with self._asking():
            obstore.delete(self._patient if self._bulk else self._one_by_one, keys)

    def keys(self, first: int | None = None) -> Iterator[str]:
        """Those of all objects but the identity, or those that begin with a byte."""
        begin, end = ("0", "g") if first is None else (f"{first:02x}", f"{first:02x}g")
        with self._asking():
            for page in obstore.list(self._patient, offset=begin, chunk_size=1000):
                for meta in page:
                    if meta["path"] >= end:
                        return
                    if _KEY.fullmatch(meta["path"]):
                        yield meta["path"]

    def abort_uploads(self, key: str) -> None:
        """Have the server drop the parts of an object that were sent and never made a whole.

        A server that cannot list them keeps them until a rule of its own removes them.
        """
        if not isinstance(self._patient, S3Store):
            return
        path = self._path(key)
        listed = self._request("GET", "", {"uploads": "", "prefix": path})
        for upload in ElementTree.fromstring(listed).iter() if listed else ():
            if _name(upload) == "Upload":
                told = {_name(one): one.text or "" for one in upload}
                if told.get("Key") == path:
                    self._request("DELETE", path, {"uploadId": told["UploadId"]})

    def signed_url(self, key: str, query: Mapping[str, str], seconds: int) -> str | None:
        """An address from which anybody may get an object, for so long; None where none can be.

        ``query``  is signed with it: what the headers of the answer are to say.
        """
        if not isinstance(self._patient, S3Store):
            return None
        with self._asking():
            return signed_address("GET", self.address.bucket, self._path(key), query, seconds)

    def _request(self, method: HTTP_METHOD, path: str, query: Mapping[str, str]) -> bytes | None:
        """The answer to what obstore has no call for; None where the server has none either."""
        with self._asking():
            url = signed_address(method, self.address.bucket, path, query, _SIGNED_SECONDS)
            try:
                answer = httpx.request(method, url, timeout=30.0)
            except httpx.HTTPError as error:
                raise self._trouble(f"{type(error).__name__}: {error}") from error
        if answer.status_code in (404, *_UNKNOWN_CALL):
            return None
        if answer.is_error:
            raise self._trouble(f"status code: {answer.status_code} {answer.text}")
        return answer.content

    def _path(self, key: str) -> str:
        return f"{self.address.prefix}/{key}".lstrip("/")

    # Whose it is: a :class:`~service.storage.blobs.identity.Home`.

    def __str__(self) -> str:
        return str(self.address)

    @property
    def place(self) -> str:
        return f"'{self}'"

    def read_identity(self) -> str | None:
        """None where nobody has said so."""
        try:
            return bytes(self.get(IDENTITY, 0, 1000)).decode("ascii", "replace").strip()
        except KeyError:
            return None

    def write_identity(self, identity: str) -> None:
        self.put(IDENTITY, identity.encode())

    # How it is.

    def check(self) -> None:
        """See within seconds that all may be done that has to be.

        Raises :class:`~service.errors.SettingsError`.
        """
        probe = os.urandom(16).hex()
        try:
            self._glance()
            next(iter(obstore.list(self._brief, chunk_size=1)), None)
            obstore.put(self._brief, probe, b"", use_multipart=False)
            self._bulk = self._removes_many(probe)
            if not self._bulk:
                obstore.delete(self._one_by_one, probe)
        except (BaseError, FileNotFoundError) as error:
            raise SettingsError(settings_fault(str(self.address), str(error))) from error

    def _removes_many(self, probe: str) -> bool:
        """Whether the server takes several keys at once."""
        try:
            obstore.delete(self._brief, [probe])
        except BaseError as error:
            if status_of(str(error)) not in _UNKNOWN_CALL:
                raise
            return False
        return True

    def check_there(self) -> None:
        """Raises :class:`~service.errors.NotReadyError` where it was away a moment ago."""
        if self._away and (words := self.problem()) is not None:
            raise _not_ready(words)

    def problem(self) -> str | None:
        """Why it cannot be used at the moment, in words; None where it can."""
        with self._lock:
            now = time.monotonic()
            if now - self._looked < _GLANCE:
                return self._seen
            self._looked = now  # whoever asks meanwhile is told what was seen last
        try:
            self._glance()
        except (BaseError, FileNotFoundError) as error:
            self._seen = in_words(str(error))
        else:
            if self._away:
                _log.info("%s can be used again", self.address)
            self._away, self._seen = False, None
        return self._seen

    def _glance(self) -> None:
        """One request, answered within seconds or not at all."""
        try:
            obstore.get(self._brief, IDENTITY).bytes()
        except FileNotFoundError as error:
            if code_of(str(error)) == "NoSuchBucket":
                raise

    @contextmanager
    def _asking(self) -> Iterator[None]:
        self.check_there()
        with self._translating():
            yield

    @contextmanager
    def _translating(self) -> Iterator[None]:
        try:
            yield
        except FileNotFoundError as error:
            if code_of(str(error)) == "NoSuchBucket":
                raise self._trouble(str(error)) from error
            raise KeyError(str(error).partition("\n")[0]) from None
        except BaseError as error:
            raise self._trouble(str(error)) from error

    def _trouble(self, told: str) -> ServiceError:
        if is_full(told):
            return DiskFullError(
                "the bucket takes no more",
                remedy="try again later; whoever runs the service has to make room there",
            )
        self._note_away(told)
        return _not_ready(in_words(told))

    def _note_away(self, told: str) -> None:
        """It was tried for long."""
        if not self._away:
            _log.error("%s cannot be used: %s", self.address, told.partition("\n\n")[0])
        self._away, self._seen = True, in_words(told)


def _store(
    address: Address, client: ClientConfig, retry: RetryConfig, *, bulk: bool = True
) -> S3Store:
    """``bulk``  whether several keys are deleted at once, unless ``AWS_*`` say otherwise."""
    config: S3Config = {} if bulk else {"disable_bulk_delete": True}
    return S3Store(
        address.bucket, prefix=address.prefix or None, config=config, client_options=client,
        retry_config=retry,
    )  # fmt: skip


def _not_ready(words: str) -> NotReadyError:
    return NotReadyError(
        f"what stores files cannot be used at the moment ({words})",
        remedy="try again in a minute",
    )


def _name(element: ElementTree.Element) -> str:
    """Without its namespace."""
    return element.tag.rpartition("}")[2]
