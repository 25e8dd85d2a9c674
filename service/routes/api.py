"""All routes as one application, and its OpenAPI document."""

from __future__ import annotations

import json
import re
from typing import Any

from fastapi import FastAPI
from fastapi.routing import APIRoute
from pydantic.json_schema import models_json_schema
from starlette.types import Lifespan

from service.answers.problems import MEDIA_TYPE, Problem, handle_failures
from service.routes import (
    assets,
    deliveries,
    explanations,
    health,
    jobs,
    keys,
    progress,
    results,
    submit,
    tradeoff,
)
from service.routes.docs import refusal
from service.schemas.asset import AssetBody
from service.schemas.job import JobBody
from service.schemas.result import Result
from simplifier import __version__

_TAGS = [
    {"name": "submit", "description": "Send a mesh, get a job."},
    {"name": "jobs", "description": "Follow jobs, end them, do them again."},
    {"name": "results", "description": "What jobs have made."},
    {"name": "assets", "description": "Names with their runs, and what is demanded of them."},
    {"name": "webhooks", "description": "Who was told that a job has ended, and who was not."},
    {"name": "keys", "description": "Who may do what, and who did: for admins."},
    {"name": "service", "description": "How the service itself is."},
]
_DESCRIPTION = (
    "Post any triangle mesh and get back a handful of triangles that hide nearly the same, with "
    "precision and recall.\n\n"
    "Times are ISO 8601, UTC. Shares are 0 to 1. Every refusal is `application/problem+json`: its "
    "`type` stays the same and leads to a page, its `detail` says what is wrong, its `remedy` what "
    "to do. A key is needed as soon as others than the service's own machine can reach it."
)

_ROUTES = (
    submit,
    tradeoff,
    jobs,
    progress,
    results,
    assets,
    deliveries,
    keys,
    health,
    explanations,
)

_WRITTEN_BY_ROUTES = (JobBody, Result, AssetBody, Problem)
_OF_FASTAPI = "HTTPValidationError"
Document = dict[str, Any]


def make_api(lifespan: Lifespan[FastAPI] | None = None) -> FastAPI:
    """The application; ``lifespan`` has to set ``app.state.services``."""
    app = FastAPI(
        title="planar-occluder",
        version=__version__,
        description=_DESCRIPTION,
        openapi_tags=_TAGS,
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        generate_unique_id_function=_name,
        separate_input_output_schemas=False,
    )
    handle_failures(app, [route for room in _ROUTES for route in room.router.routes])
    for room in _ROUTES:
        app.include_router(room.router)
    explanations.add_swagger(app)
    describe(app)
    return app


def _name(route: APIRoute) -> str:
    return route.name


def describe(app: FastAPI) -> None:
    """Let ``app.openapi()`` give the completed document."""
    plain = app.openapi
    completed: list[Document] = []

    def openapi() -> Document:
        if not completed:
            completed.append(_complete(json.loads(_in_public(json.dumps(plain())))))
        return completed[0]

    app.openapi = openapi  # type: ignore[method-assign]


def _complete(document: Document) -> Document:
    components = document["components"]
    components["schemas"] = _schemas(components["schemas"])
    components["responses"] = {}
    for path in document["paths"].values():
        for operation in path.values():
            _let_open(operation)
            _name_problems(operation["responses"], components["responses"])
    components["responses"] = dict(sorted(components["responses"].items()))
    return document


def _in_public(document: str) -> str:
    """A document, as JSON, with models by the names that they have outside.

    What is a JobBody here, since a Job is a value of ours, is a Job to everybody else.
    """
    return re.sub(r'(?<=["/])([A-Z]\w*)Body(?=")', r"\1", document)


def _schemas(known: Document) -> Document:
    """The schemas with those of bodies that routes write, and without FastAPI's own refusal."""
    models = [(model, "serialization") for model in _WRITTEN_BY_ROUTES]
    _, more = models_json_schema(models, ref_template="#/components/schemas/{model}")  # type: ignore[arg-type]
    schemas = {**json.loads(_in_public(json.dumps(more["$defs"]))), **known}
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
