"""What OpenAPI says of routes that take uploads: FastAPI does not see into their bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from service.headers.idempotency_key import IDEMPOTENCY_KEY
from service.headers.prefer import PREFER
from service.jobs.asset import LONGEST_NAME
from service.jobs.delivery import LONGEST_URL
from service.jobs.job import JobKind
from service.schemas.job_options import option_tables
from service.uploads.receiving import Wanted

_TABLES = option_tables(math.inf, math.inf)
_FILE: dict[str, Any] = {"type": "string", "format": "binary", "minLength": 1}

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
]  # fmt: skip
_FILENAME = {
    "name": "filename", "in": "query",
    "description": "Name of a raw body; its suffix says the format, else the media type does.",
    "schema": {"type": "string", "minLength": 1},
    "example": "castle.glb",
}  # fmt: skip


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
