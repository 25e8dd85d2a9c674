"""Every refusal of the service, each an answer by RFC 9457 (``application/problem+json``).

A problem has a stable ``type``, ``/problems/<slug>``, that programs may compare and people may
open; a ``detail`` that says what is wrong and where; and a ``remedy`` that says what to do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True)
class FieldError:
    """What is wrong with one field of a request: its name, the fault and what to do."""

    field: str
    detail: str
    remedy: str = ""


class ServiceError(Exception):
    """What went wrong and what to do.

    ``detail`` and ``remedy`` are sentences without a full stop.  ``extra`` are members of the
    answer beside the standard ones; ``headers`` go with it.
    """

    slug: ClassVar[str] = "internal-error"
    status: ClassVar[int] = 500
    title: ClassVar[str] = "The service failed"

    def __init__(
        self,
        detail: str,
        *,
        remedy: str = "",
        extra: Mapping[str, Any] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        self.detail = detail
        self.remedy = remedy
        self.extra = dict(extra or {})
        self.headers = dict(headers or {})
        super().__init__(f"{detail}; {remedy}" if remedy else detail)


class BadRequestError(ServiceError):
    """The request cannot be understood."""

    slug, status, title = "bad-request", 400, "The request cannot be understood"


class UnreadableMeshError(ServiceError):
    """The mesh cannot be read, or no triangle of it can be used."""

    slug, status, title = "unreadable-mesh", 400, "The mesh cannot be read"


class InvalidOverridesError(ServiceError):
    """The overrides are damaged, say what cannot be, or name what the mesh does not have."""

    slug, status, title = "invalid-overrides", 400, "The overrides cannot be used"


class UnauthenticatedError(ServiceError):
    """There is no API key, or none that is known."""

    slug, status, title = "unauthenticated", 401, "An API key is needed"

    def __init__(self, detail: str, *, remedy: str = "") -> None:
        super().__init__(detail, remedy=remedy, headers={"WWW-Authenticate": "Bearer"})


class ForbiddenError(ServiceError):
    """The key does not allow this, or the request comes from where none may."""

    slug, status, title = "forbidden", 403, "This is not allowed"


class NotFoundError(ServiceError):
    """There is no such thing, or it belongs to another tenant."""

    slug, status, title = "not-found", 404, "There is no such thing"


class MethodNotAllowedError(ServiceError):
    """The address is right, and there is nothing to be done there by this method."""

    slug, status, title = "method-not-allowed", 405, "The method is not allowed here"


class NotAcceptableError(ServiceError):
    """Nothing of what the request accepts can be given."""

    slug, status, title = "not-acceptable", 406, "The result has no such format"


class UploadTimeoutError(ServiceError):
    """The body comes too slowly."""

    slug, status, title = "upload-timeout", 408, "The upload came too slowly"


class ConflictError(ServiceError):
    """The state of things does not allow this."""

    slug, status, title = "conflict", 409, "This conflicts with the present state"


class RequestUnderWayError(ServiceError):
    """The same Idempotency-Key came with a request that is still being worked on."""

    slug, status, title = "request-under-way", 409, "The request is still being worked on"

    def __init__(self, key: str) -> None:
        super().__init__(
            f"a request with the Idempotency-Key '{key}' is still being worked on",
            remedy="send it again in a moment, and its answer will be there",
            headers={"Retry-After": "1"},
        )


class TooLargeError(ServiceError):
    """The body is larger than the limit."""

    slug, status, title = "too-large", 413, "The upload is too large"


class UnsupportedMediaTypeError(ServiceError):
    """The body is in no format that can be read."""

    slug, status, title = "unsupported-media-type", 415, "The format is not known"


class RangeNotSatisfiableError(ServiceError):
    """The range lies outside of the file."""

    slug, status, title = "range-not-satisfiable", 416, "The range lies outside of the file"

    def __init__(self, size: int) -> None:
        super().__init__(
            f"the range lies outside of the file's {size} bytes",
            remedy="ask for a part that lies within",
            headers={"Content-Range": f"bytes */{size}"},
        )


class MisdirectedError(ServiceError):
    """The request is for a host that this service is not."""

    slug, status, title = "misdirected", 421, "This service is not that host"


class InvalidOptionsError(ServiceError):
    """A field of the request is missing, unknown or out of range; ``errors`` says so of each."""

    slug, status, title = "invalid-options", 422, "A field of the request is not valid"

    def __init__(self, errors: Sequence[FieldError]) -> None:
        self.errors = tuple(errors)
        first = self.errors[0]
        more = f", and {len(self.errors) - 1} more" if len(self.errors) > 1 else ""
        super().__init__(
            f"{first.field}: {first.detail}{more}",
            remedy=first.remedy,
            extra={
                "errors": [
                    {"field": one.field, "detail": one.detail, "remedy": one.remedy}
                    for one in self.errors
                ]
            },
        )


class IdempotencyKeyReusedError(ServiceError):
    """The Idempotency-Key came with another request before."""

    slug, status, title = "idempotency-key-reused", 422, "The key was used for another request"

    def __init__(self, key: str) -> None:
        super().__init__(
            f"the Idempotency-Key '{key}' was used for another request",
            remedy="choose a new key for a new request",
        )


class TooManyAttemptsError(ServiceError):
    """Keys that nobody has were tried too often from one address."""

    slug, status, title = "too-many-attempts", 429, "Too many unknown keys were tried"

    def __init__(self, retry_after: int) -> None:
        super().__init__(
            "too many unknown API keys came from this address",
            remedy=f"check the key, and try again in {retry_after} seconds",
            headers={"Retry-After": str(retry_after)},
        )


class QueueFullError(ServiceError):
    """As many jobs wait as may."""

    slug, status, title = "queue-full", 429, "The queue is full"

    def __init__(self, waiting: int, retry_after: int) -> None:
        super().__init__(
            f"{waiting} jobs are waiting, and no more may",
            remedy=f"try again in {retry_after} seconds",
            headers={"Retry-After": str(retry_after)},
        )


class TenantQueueFullError(QueueFullError):
    """As many jobs of the tenant wait as may of one."""

    slug, title = "tenant-queue-full", "Too many jobs of yours are waiting"

    def __init__(self, waiting: int, retry_after: int) -> None:
        ServiceError.__init__(
            self,
            f"{waiting} jobs of yours are waiting, and no more of one tenant may",
            remedy=f"cancel those that are not needed, or try again in {retry_after} seconds",
            headers={"Retry-After": str(retry_after)},
        )


class HeadersTooLargeError(ServiceError):
    """The request line and the headers have more bytes than they may."""

    slug, status, title = "headers-too-large", 431, "The headers are too large"


class JobFailedError(ServiceError):
    """The job that the answer waited for has failed, and not for what was sent."""

    slug, status, title = "job-failed", 500, "The job failed"


class DatabaseDamagedError(ServiceError):
    """A page of the database cannot be read."""

    slug, status, title = "database-damaged", 500, "The database is damaged"


class NotReadyError(ServiceError):
    """The service starts, stops, or cannot reach what it needs."""

    slug, status, title = "not-ready", 503, "The service is not ready"


class HoldLostError(ServiceError):
    """What was stored for this was taken for that of a dead server, and is no longer stored."""

    slug, status, title = "hold-lost", 503, "The uploaded file is no longer stored"


class DiskFullError(ServiceError):
    """There is no room for the upload or the result."""

    slug, status, title = "disk-full", 507, "The disk is full"


class SettingsError(Exception):
    """The service cannot start as it is set up: what, and what to do."""
