"""Refusals as RFC 9457 has them: every failure becomes ``application/problem+json``, in one place.

No traceback leaves.  A job that has no result is a failure too: what is answered for it is told
from its own.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict, Field
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from service.answers.field_faults import field_fault
from service.errors import (
    BadRequestError,
    ConflictError,
    DiskFullError,
    FieldError,
    InvalidOptionsError,
    InvalidOverridesError,
    JobFailedError,
    MethodNotAllowedError,
    NotFoundError,
    NotReadyError,
    ServiceError,
    UnreadableMeshError,
    UnsupportedMediaTypeError,
)
from service.jobs.job import Failure, Job
from service.schemas.job import FailureBody

MEDIA_TYPE = "application/problem+json"

_LOG = logging.getLogger(__name__)
_LONGEST_ECHO = 200
_KINDS: dict[str, type[ServiceError]] = {
    "unreadable-mesh": UnreadableMeshError,
    "invalid-overrides": InvalidOverridesError,
    "disk-full": DiskFullError,
    "unavailable": NotReadyError,
}
"""Kinds of failure that are problems of their own; any other is a failed job."""


class FieldProblem(BaseModel):
    """What is wrong with one field of a request."""

    field: str = Field(description="Its name.", examples=["budget"])
    detail: str = Field(description="The fault.", examples=["0 is out of range"])
    remedy: str = Field(description="What to do.", examples=["choose 1 to 100,000"])


class Problem(BaseModel):
    """Why a request was refused, and what to do."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(
        description="`/problems/` and a word that stays the same; the page there says more.",
        examples=["/problems/invalid-options"],
    )
    title: str = Field(description="The kind of problem, in words.")
    status: int = Field(description="The HTTP status.", examples=[422])
    detail: str = Field(description="What is wrong here, and where.")
    remedy: str = Field(description="What to do about it; may be empty.")
    instance: str = Field(description="The path that was asked for.")
    errors: list[FieldProblem] | None = Field(
        None, description="Each field that is wrong, where fields are."
    )


def problem_of(error: ServiceError, instance: str) -> dict[str, Any]:
    """The members of the answer; those that an error has beside the standard ones among them."""
    return {
        "type": f"/problems/{error.slug}",
        "title": error.title,
        "status": error.status,
        "detail": error.detail,
        "remedy": error.remedy,
        "instance": instance,
        **error.extra,
    }


class ProblemResponse(Response):
    """A refusal; ``path`` is what was asked for.

    In ASCII: what it repeats of the request may be no valid Unicode.
    """

    media_type = MEDIA_TYPE

    def __init__(self, error: ServiceError, path: str) -> None:
        instance = quote(path, safe="/:@!$&'()*+,;=~%")
        super().__init__(problem_of(error, instance), error.status, error.headers)

    def render(self, content: Mapping[str, Any]) -> bytes:
        return json.dumps(content).encode("ascii")


def _answer(request: Request, error: ServiceError) -> ProblemResponse:
    # Not from request.url, which drops line breaks.
    return ProblemResponse(error, request.scope["path"])


def handle_failures(app: FastAPI, routes: Sequence[BaseRoute] = ()) -> None:
    """Let the application answer every failure with a problem.

    ``routes``  those that a wrong method is told of.
    """

    async def of_service(request: Request, error: Exception) -> Response:
        assert isinstance(error, ServiceError)
        if error.status == 500:
            _LOG.error("%s %s: %s", request.method, request.scope["path"], error)
        return _answer(request, error)

    async def of_fields(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        return _answer(request, _of_fields(request, error))

    async def of_http(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        return _answer(request, _of_http(request, error, routes))

    async def of_leaving(request: Request, error: Exception) -> Response:
        # Nobody is there to read it.
        return _answer(request, BadRequestError("the request broke off"))

    async def of_anything(request: Request, error: Exception) -> Response:
        # The server logs the error with its traceback, which goes no further.
        failure = ServiceError(
            "something went wrong that should not have",
            remedy="try again; if it stays, tell the service's owner, whose log says more",
        )
        return _answer(request, failure)

    app.add_exception_handler(ServiceError, of_service)
    app.add_exception_handler(RequestValidationError, of_fields)
    app.add_exception_handler(HTTPException, of_http)
    app.add_exception_handler(ClientDisconnect, of_leaving)
    app.add_exception_handler(Exception, of_anything)


def _of_http(request: Request, error: HTTPException, routes: Sequence[BaseRoute]) -> ServiceError:
    path = request.scope["path"]
    match error.status_code:
        case 405:
            methods = ", ".join(_methods(path, routes))
            return MethodNotAllowedError(
                f"'{path}' has no {request.method}",
                remedy=f"use {methods or 'GET'}",
                headers={"Allow": methods or "GET"},
            )
        case status if status < 500 and status != 404:
            return BadRequestError(str(error.detail))
        case status:
            return refusal_of(status, path)


def refusal_of(status: int, path: str) -> ServiceError:
    """What a framework's own refusal of a path amounts to, of which the status is known."""
    match status:
        case 404:
            return NotFoundError(f"there is nothing at '{path}'", remedy="see /docs")
        case 405:
            return MethodNotAllowedError(f"'{path}' has no such method", remedy="see Allow")
        case 422:
            fault = FieldError("query", "a field is missing or out of range", "follow a link here")
            return InvalidOptionsError([fault])
        case status if status < 500:
            return BadRequestError("the request cannot be understood", remedy="see /docs")
        case _:
            return ServiceError("something went wrong that should not have", remedy="try again")


def _methods(path: str, routes: Sequence[BaseRoute]) -> list[str]:
    """All methods that a path has: the router tells those of the first route alone."""
    there = [one for one in routes if isinstance(one, Route) and one.path_regex.match(path)]
    return sorted({method for one in there for method in one.methods or ()})


def _of_fields(request: Request, error: RequestValidationError) -> ServiceError:
    if isinstance(error.body, bytes):  # it was not told to be JSON, and so was not read
        return _not_told_to_be_json(request.headers.get("content-type", ""))
    faults = error.errors()
    if any(fault["type"] == "json_invalid" for fault in faults):
        return BadRequestError("the body is no JSON", remedy="send a JSON object")
    route = request.scope.get("route")
    return InvalidOptionsError([field_fault(route, fault) for fault in faults])


def _not_told_to_be_json(media_type: str) -> UnsupportedMediaTypeError:
    told = f"its Content-Type is {ascii(media_type)[:_LONGEST_ECHO]}" if media_type else ""
    return UnsupportedMediaTypeError(
        f"the body has to be JSON, and {told or 'the request has no Content-Type'}",
        remedy="send JSON with the header -H 'Content-Type: application/json'",
    )


def problem_of_job(job: Job) -> ServiceError:
    """Why there is no result for whoever waited for it; ``job`` has failed or was cancelled."""
    if job.failure is None:
        return problem_of_state(job)
    error = _of_failure(job.failure)
    error.extra |= _about(job)
    return error


def problem_of_state(job: Job) -> ConflictError:
    """Why there is no result to be had of a job that has not succeeded."""
    if job.failure is not None:
        detail, remedy = f"the job has failed: {job.failure.detail}", job.failure.remedy
    else:
        detail = f"the job is {job.state}"
        again = "POST to its 'retry'"
        remedy = again if job.state.ended else "follow its 'events', or ask again later"
    return ConflictError(detail, remedy=remedy, extra=_about(job))


def _of_failure(failure: Failure) -> ServiceError:
    if failure.kind == "invalid-options":
        return InvalidOptionsError([FieldError("options", failure.detail, failure.remedy)])
    kind = _KINDS.get(failure.kind, JobFailedError)
    return kind(failure.detail, remedy=failure.remedy)


def _about(job: Job) -> dict[str, Any]:
    """What goes along with a refusal of a job: where the job is, and why it failed."""
    about: dict[str, Any] = {"job": f"/v1/jobs/{job.id}"}
    if job.failure is not None:
        failure = FailureBody.model_validate(job.failure, from_attributes=True)
        about["failure"] = failure.model_dump()
    return about
