"""What a client raises: the server's problem (RFC 9457), or that none could be asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import httpx

from service.errors import FieldError


@dataclass(frozen=True)
class Problem:
    """A refusal as it came.

    ``slug``    the last part of its ``type``: stable, for programs; empty where no answer came or
                one that is not of the service.
    ``status``  of the answer; 0 where none came.
    ``errors``  what is wrong with each field of the request.
    """

    slug: str
    title: str
    status: int
    detail: str
    remedy: str = ""
    errors: tuple[FieldError, ...] = ()


class ClientError(Exception):
    """The server refused, or could not be asked; ``problem`` says which and what to do."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        said = [f"{one.field}: {one.detail}" for one in problem.errors] or [problem.detail]
        super().__init__("; ".join([*said, *filter(None, [problem.remedy])]))


class StoppedError(Exception):
    """The caller's event ended the call."""


def refusal(response: httpx.Response) -> ClientError:
    """The error of an answer whose body was read."""
    try:
        body = response.json()
    except ValueError:
        body = None
    if not isinstance(body, dict) or "detail" not in body:
        return _foreign(response)
    return ClientError(
        Problem(
            slug=str(body.get("type", "")).rpartition("/")[2],
            title=str(body.get("title", "")),
            status=response.status_code,
            detail=str(body["detail"]),
            remedy=str(body.get("remedy") or ""),
            errors=tuple(_field_error(one) for one in body.get("errors") or ()),
        )
    )


def no_answer(server: str, error: Exception) -> ClientError:
    """The error of a request that got no answer, or could not be sent to any server."""
    if isinstance(error, httpx.UnsupportedProtocol):
        where = server.rstrip("/")
        detail = f"'{where}' is no address of a server"
        remedy = "the address needs http:// or https://, as in http://127.0.0.1:8000"
        return ClientError(Problem("", "The server cannot be reached", 0, detail, remedy))
    detail = f"{server} does not answer ({error or type(error).__name__})"
    remedy = "check the address and whether the service runs there"
    return ClientError(Problem("", "The server cannot be reached", 0, detail, remedy))


def damaged_answer(what: str) -> ClientError:
    """The error of an answer that is not what its server announced."""
    remedy = "try again, and look for proxies on the way"
    return ClientError(Problem("", "The answer is damaged", 0, what, remedy))


def _foreign(response: httpx.Response) -> ClientError:
    return ClientError(
        Problem(
            slug="",
            title=response.reason_phrase,
            status=response.status_code,
            detail=f"{response.url.copy_with(query=None)} answers "
            f"{response.status_code} {response.reason_phrase}",
            remedy="check that an occluder service is at this address",
        )
    )


def _field_error(data: Any) -> FieldError:
    return FieldError(
        str(data.get("field", "")), str(data.get("detail", "")), str(data.get("remedy") or "")
    )
