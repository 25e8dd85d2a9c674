"""The OpenAPI document, completed by what FastAPI cannot know of the routes."""

from __future__ import annotations

import json
from typing import Any

from fastapi import FastAPI
from pydantic.json_schema import models_json_schema

from service.routes.docs import refusal
from service.schemas.asset import Asset
from service.schemas.job import Job
from service.schemas.problem import MEDIA_TYPE, Problem
from service.schemas.result import Result

_WRITTEN_BY_ROUTES = (Job, Result, Asset, Problem)
_OF_FASTAPI = "HTTPValidationError"

Document = dict[str, Any]


def describe(app: FastAPI) -> None:
    """Let ``app.openapi()`` give the completed document."""
    plain = app.openapi
    completed: list[Document] = []

    def openapi() -> Document:
        if not completed:
            completed.append(_completed(json.loads(json.dumps(plain()))))
        return completed[0]

    app.openapi = openapi  # type: ignore[method-assign]


def _completed(document: Document) -> Document:
    components = document["components"]
    components["schemas"] = _schemas(components["schemas"])
    components["responses"] = {}
    for path in document["paths"].values():
        for operation in path.values():
            _let_open(operation)
            _name_problems(operation["responses"], components["responses"])
    components["responses"] = dict(sorted(components["responses"].items()))
    return document


def _schemas(known: Document) -> Document:
    """With those that routes write themselves, and without FastAPI's own refusal."""
    models = [(model, "serialization") for model in _WRITTEN_BY_ROUTES]
    _, more = models_json_schema(models, ref_template="#/components/schemas/{model}")  # type: ignore[arg-type]
    schemas = {**more["$defs"], **known}
    return {
        name: schema
        for name, schema in sorted(schemas.items())
        if name not in (_OF_FASTAPI, "ValidationError")
    }


def _let_open(operation: Document) -> None:
    """A key is needed only where others can reach the service: none is one of the ways."""
    if "security" in operation:
        operation["security"] = [{"bearer": []}, {"key": []}, {}]


def _name_problems(responses: Document, problems: Document) -> None:
    """Say each problem once, and refer to it; drop what FastAPI adds and no route answers."""
    for status in list(responses):
        content = responses[status].get("content", {})
        if MEDIA_TYPE in content:
            problems[f"Problem{status}"] = refusal(int(status))
            responses[status] = {"$ref": f"#/components/responses/Problem{status}"}
        elif _OF_FASTAPI in json.dumps(content):
            del responses[status]
