"""Pieces of the OpenAPI document that FastAPI cannot know."""

from __future__ import annotations

from typing import Any

from service.schemas.problem import MEDIA_TYPE

Responses = dict[int | str, dict[str, Any]]

_MEANINGS = {
    400: "The request, or a file in it, cannot be read.",
    401: "An API key is needed.",
    403: "This is not allowed.",
    404: "There is no such thing.",
    405: "There is no such method here.",
    406: "Nothing that is accepted can be given.",
    408: "The upload came too slowly.",
    409: "The present state does not allow it.",
    413: "The upload is too large.",
    415: "The format is not known.",
    416: "The range lies outside of the file.",
    421: "The request is for another host.",
    422: "Fields are wrong; `errors` names each.",
    429: "Too much at once; try again after `Retry-After`.",
    500: "The service failed.",
    503: "The service is not ready.",
    507: "The disk is full.",
}

_RETRY_AFTER = {
    "Retry-After": {
        "description": "Seconds to wait.",
        "schema": {"type": "integer", "minimum": 0},
    }
}
_HEADERS: dict[int, dict[str, Any]] = {
    401: {"WWW-Authenticate": {"description": "How to show a key.", "schema": {"type": "string"}}},
    416: {"Content-Range": {"description": "The file's length.", "schema": {"type": "string"}}},
    429: _RETRY_AFTER,
}

EVERYWHERE = (400, 401, 403, 421, 422, 429, 500, 503)
"""What every route under /v1 may answer: keys, foreign pages, wrong parameters, a broken disk."""


def refusals(*statuses: int) -> Responses:
    """Documented problems, one a status."""
    return {status: refusal(status) for status in sorted(set(statuses))}


def refusal(status: int) -> dict[str, Any]:
    """One of them."""
    body = {"schema": {"$ref": "#/components/schemas/Problem"}}
    documented: dict[str, Any] = {
        "description": _MEANINGS[status],
        "content": {MEDIA_TYPE: body},
    }
    if status in _HEADERS:
        documented["headers"] = _HEADERS[status]
    return documented


def header(description: str, *, required: bool = False) -> dict[str, Any]:
    """A header of an answer."""
    return {"description": description, "required": required, "schema": {"type": "string"}}


def binary(*media_types: str) -> dict[str, Any]:
    """Bytes, in one of some formats."""
    return {one: {"schema": {"type": "string", "format": "binary"}} for one in media_types}


def anything() -> dict[str, Any]:
    """Bytes in whatever format a file has."""
    return {"*/*": {"schema": {}}}


def json_of(model: str) -> dict[str, Any]:
    """A model, by name, as JSON."""
    return {"application/json": {"schema": {"$ref": f"#/components/schemas/{model}"}}}
