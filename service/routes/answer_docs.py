"""What OpenAPI says of results and files: FastAPI does not see what routes write themselves."""

from __future__ import annotations

from typing import Any

from service.answers.formats import FORMATS
from service.routes.docs import (
    EVERYWHERE,
    Responses,
    anything,
    binary,
    header,
    json_of,
    refusals,
)

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


_PLACE = {
    "Location": header("The job.", required=True),
    "Preference-Applied": header("That it was waited for."),
}

RESULT_OR_JOB: Responses = {
    200: {**RESULT[200], "headers": {**RESULT[200]["headers"], **_PLACE}},
    202: {
        "description": "The job, which goes on.",
        "content": json_of("Job"),
        "headers": _PLACE,
    },
    **refusals(*EVERYWHERE, 404, 406, 408, 409, 413, 415, 507),
}
"""What an upload is answered with."""
