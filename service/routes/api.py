"""All routes as one application."""

from __future__ import annotations

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.types import Lifespan

from service.answers.problems import handle_failures
from service.routes import (
    assets,
    evaluations,
    explanations,
    health,
    jobs,
    metrics,
    occluders,
    pictures,
    problems,
    progress,
    results,
    scenes,
    tradeoff,
)
from service.routes.description import describe
from simplifier import __version__

_TAGS = [
    {"name": "submit", "description": "Send a mesh, get a job."},
    {"name": "jobs", "description": "Follow jobs, end them, do them again."},
    {"name": "results", "description": "What jobs have made."},
    {"name": "assets", "description": "Names with their runs, and what is demanded of them."},
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
    occluders, evaluations, scenes, tradeoff, jobs, progress, pictures, results, assets, health,
    metrics, problems,
)  # fmt: skip


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
    app.include_router(explanations.router)
    explanations.add_swagger(app)
    describe(app)
    return app


def _name(route: APIRoute) -> str:
    return route.name
