"""What the OpenAPI document says beyond what FastAPI can see of a route.

FastAPI sees neither into bodies that a route reads itself nor into answers that it writes itself,
so refusals, files, results and uploads are described here, and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from service.answers.files import FORMATS
from service.answers.problems import MEDIA_TYPE
from service.jobs.asset import LONGEST_NAME
from service.jobs.job import JobKind, Priority
from service.jobs.stores import LONGEST_URL
from service.keep import Keep
from service.schemas.job_options import option_tables
from service.uploads.receiving import Wanted

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
    409: {
        "Retry-After": {
            "description": "Seconds to wait, where the same request is still being worked on.",
            "schema": {"type": "integer", "minimum": 0},
        }
    },
    401: {"WWW-Authenticate": {"description": "How to show a key.", "schema": {"type": "string"}}},
    416: {"Content-Range": {"description": "The file's length.", "schema": {"type": "string"}}},
    429: _RETRY_AFTER,
}

EVERYWHERE = (400, 401, 403, 421, 422, 429, 500, 503)
"""What every route under /v1 may answer: keys, foreign pages, wrong parameters, a broken disk."""

# Range and If-Range are described in words: checkers of this document take every answer that says
# application/json for a whole JSON text, which a part is not.
CONDITIONS: dict[str, Any] = {
    "parameters": [
        {
            "name": "If-None-Match",
            "in": "header",
            "description": "ETags that you have: 304 where the file is one of them.",
            "schema": {"type": "string"},
        }
    ]
}
"""Headers that a request for a file may have."""
_TABLES = option_tables(math.inf, math.inf)
_FILE: dict[str, Any] = {"type": "string", "format": "binary", "minLength": 1}
IDEMPOTENCY_KEY: dict[str, Any] = {
    "name": "Idempotency-Key", "in": "header",
    "description": "Of your own making. For 24 hours the same request under the same key is done "
    "once and answered as it was, with `Idempotent-Replayed: true`. Another request under it is "
    "refused (422), and so is the same one while it is being worked on (409).",
    "schema": {"type": "string", "minLength": 1, "maxLength": 255, "pattern": "^[!-~]+$"},
}  # fmt: skip
"""A header of requests that change something."""

PREFER: dict[str, Any] = {
    "name": "Prefer", "in": "header",
    "description": "`wait=N`: wait up to N seconds for the result. `return=representation`: answer "
    "with nothing else; as long as there is none, 303 leads to where it is waited for again.",
    "schema": {"type": "string"}, "example": "wait=30",
}  # fmt: skip
"""A header of requests that may wait for a result."""

_LABELS: list[dict[str, Any]] = [
    {
        "name": "asset", "in": "query",
        "description": "The asset whose run it becomes, by name; made when it is new.",
        "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_NAME},
        "example": "props/castle",
    },
    {
        "name": "webhook", "in": "query",
        "description": "Who is told when the job ends: an http or https address.",
        "schema": {"type": "string", "format": "uri", "minLength": 1, "maxLength": LONGEST_URL},
    },
    {
        "name": "priority", "in": "query",
        "description": "Of your own jobs, `interactive` ones go first and `bulk` ones behind them, "
        "though after three in a row one that waits has its turn.",
        "schema": {
            "type": "string", "enum": [str(one) for one in Priority],
            "default": str(Priority.INTERACTIVE),
        },
    },
    {
        "name": "keep", "in": "query",
        "description": "Of the result of an occluder or an evaluation, `all` files are stored, or "
        "only the occluder and its report (`lean`), from which the others are made when they are "
        "first asked for. Without, as `OCCLUDER_KEEP` says.",
        "schema": {"type": "string", "enum": [str(one) for one in Keep]},
    },
]  # fmt: skip
_FILENAME = {
    "name": "filename", "in": "query",
    "description": "Name of a raw body; its suffix says the format, else the media type does.",
    "schema": {"type": "string", "minLength": 1},
    "example": "castle.glb",
}  # fmt: skip


def refusals(*statuses: int) -> Responses:
    """Documented problems, one a status."""
    return {status: refusal(status) for status in sorted(set(statuses))}


def refusal(status: int) -> dict[str, Any]:
    """The documented problem of one status."""
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


_FILE_HEADERS = {
    "ETag": header("The SHA-256 of the whole file."),
    "Accept-Ranges": header("`bytes`."),
    "Cache-Control": header("A file of a job never changes."),
}
_FRESH = {"description": "You have these bytes already.", "headers": _FILE_HEADERS}

FILE: Responses = {
    200: {"description": "Its bytes.", "headers": _FILE_HEADERS, "content": anything()}
}
"""A whole file."""

PARTS: Responses = {
    206: {
        "description": "The part that `Range` asks for.",
        "headers": {**_FILE_HEADERS, "Content-Range": header("Which part of how much.")},
        "content": anything(),
    },
    304: _FRESH,
}
"""What a file may be answered with in place of all of it."""

ZIPPED: Responses = {
    200: {
        "description": "A zip with one folder.",
        "headers": {"Content-Disposition": header("A name for the zip.", required=True)},
        "content": binary("application/zip"),
    }
}
"""All files at once."""

HEAD: Responses = {
    200: {"description": "It is there.", "headers": _FILE_HEADERS},
    304: _FRESH,
}
"""A file without its bytes."""

RESULT: Responses = {
    200: {
        "description": "The result, or the file that `Accept` asks for: GLB with all levels of "
        "detail, the other formats with the finest.",
        "content": {
            **json_of("Result"),
            **binary(*dict.fromkeys(kind for by_kind in FORMATS.values() for kind in by_kind)),
        },
        "headers": {
            "Vary": header("`Accept` among others."),
            "ETag": header("The SHA-256, for a file."),
        },
    }
}
"""The result of a job."""


_PLACE = {
    "Location": header("The job.", required=True),
    "Preference-Applied": header("That it was waited for."),
}

NEW_JOB = {"headers": {"Location": header("The new job.", required=True)}}
"""How a job that a job or an asset has given is sent."""

SENT_ON: Responses = {
    303: {
        "description": "There is no result yet: ask for it there, where it is waited for again.",
        "headers": {
            "Location": header("The job's result.", required=True),
            "Preference-Applied": header("How long this one has waited."),
        },
    }
}
"""A request that wants the result and nothing else, before there is one."""

LED: Responses = {
    307: {
        "description": "It is in a bucket, and `redirect` allows to be led there.",
        "headers": {"Location": header("Where its bytes are.", required=True)},
    }
}
"""A file that is elsewhere, for who may be led there."""

RESULT_OR_JOB: Responses = {
    200: {**RESULT[200], "headers": {**RESULT[200]["headers"], **_PLACE}},
    202: {
        "description": "The job, which goes on.",
        "content": json_of("Job"),
        "headers": _PLACE,
    },
    **SENT_ON,
    **refusals(*EVERYWHERE, 404, 406, 408, 409, 413, 415, 507),
}
"""What an upload is answered with."""


def upload_docs(
    kind: JobKind, parts: Sequence[Wanted], raw: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Parameters and body.

    ``parts``  files of the form; ``raw`` media types of a body that is the first of them.
    """
    table = _TABLES[kind]
    form: dict[str, Any] = {
        "type": "object",
        "additionalProperties": False,
        "required": [one.name for one in parts if one.needed],
        "properties": {
            **{one.name: {**_FILE, "description": one.what} for one in parts},
            "options": table.schema(),
            **{one["name"]: {**one["schema"], "description": one["description"]}
               for one in _LABELS},
        },
    }  # fmt: skip
    content: dict[str, Any] = {media_type: {"schema": _FILE} for media_type in raw}
    content["multipart/form-data"] = {
        "schema": form,
        "encoding": {"options": {"contentType": "application/json"}},
    }
    named = [_FILENAME] if raw else []
    return {
        "parameters": [*table.parameters(), *_LABELS, *named, PREFER, IDEMPOTENCY_KEY],
        "requestBody": {"required": True, "content": content},
    }
