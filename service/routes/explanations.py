"""Pages that explain the API to people: each kind of problem, and the API itself to try.

A problem's page says what it means and what to do.  The API's page is Swagger UI, which asks no
other machine for anything.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from html import escape
from importlib.resources import files

from fastapi import APIRouter, FastAPI
from fastapi.responses import HTMLResponse, Response
from fastapi.staticfiles import StaticFiles

from service.errors import NotFoundError, ServiceError
from service.routes.docs import refusals

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>planar-occluder</title>
<link rel="stylesheet" href="/docs/swagger/swagger-ui.css">
<div id="api"></div>
<script src="/docs/swagger/swagger-ui-bundle.js"></script>
<script src="/docs/start.js"></script>
</html>
"""
_START = """SwaggerUIBundle({
  url: "/openapi.json",
  dom_id: "#api",
  deepLinking: true,
  docExpansion: "list",
  validatorUrl: null,
});
"""

ADVICE = {
    "bad-request": "Compare the request with /docs: its headers, its body, how the two go "
    "together.",
    "unreadable-mesh": "Open the file in the program that wrote it and export it again. The detail "
    "says what the reader found. A mesh needs at least one triangle that has an area, and may not "
    "refer to files outside of itself.",
    "invalid-overrides": "The detail names the line. docs/overrides.md says what a file of "
    "overrides may hold; names of meshes and materials have to be those of the mesh.",
    "unauthenticated": "Send a key as 'Authorization: Bearer occ_...' or 'X-API-Key: occ_...'. "
    "'occluder keys create' makes one on the machine of the service.",
    "too-many-attempts": "Too many unknown keys came from one address. Check the key, wait as long "
    "as Retry-After says, and try again.",
    "forbidden": "Use a key with a wider scope: read, write or admin. Without keys, requests have "
    "to come from the machine itself, not from a page of another site.",
    "not-found": "Check the address. Jobs are forgotten when they have been over for long; results "
    "of other tenants do not show.",
    "method-not-allowed": "The Allow header names the methods that there are.",
    "not-acceptable": "Ask for application/json, or for a format that the result links to.",
    "upload-timeout": "Send again over a faster or steadier line.",
    "conflict": "Look at the present state (GET the job or asset) and decide anew.",
    "request-under-way": "Send the same request again in a moment, under the same Idempotency-Key.",
    "idempotency-key-reused": "Take a new Idempotency-Key for each new request, and the same one "
    "only to send a request again as it was. Keys are forgotten after a day.",
    "too-large": "Send a smaller file: a binary format (GLB, PLY, STL) is smaller than text. The "
    "service's owner can raise OCCLUDER_MAX_UPLOAD.",
    "unsupported-media-type": "Say the format by ?filename=..., by the part's file name, or by the "
    "media type. The detail lists what can be read. A body of JSON needs the header "
    "'Content-Type: application/json'.",
    "range-not-satisfiable": "Content-Range says how long the file is: ask for a part of that.",
    "invalid-options": "Each member of 'errors' names one field, its fault and what to choose.",
    "misdirected": "Ask by the address that the service listens on. Behind a name of its own, the "
    "service's owner has to add that to OCCLUDER_ALLOWED_HOSTS.",
    "queue-full": "Wait as long as Retry-After says, and send again. The service's owner can raise "
    "OCCLUDER_QUEUE_LIMIT or OCCLUDER_WORKERS.",
    "tenant-queue-full": "Wait as long as Retry-After says, and send again; or cancel jobs that "
    "are not needed. The service's owner can raise OCCLUDER_TENANT_WAITING or OCCLUDER_WORKERS.",
    "headers-too-large": "Send fewer or shorter headers: 200 of them and 64 KiB, the address among "
    "them, are the most.",
    "job-failed": "'failure' says why. Out of memory or time: choose a lower resolution, or ask "
    "the service's owner for higher limits. Else try again; if it stays, tell the owner.",
    "internal-error": "Try again. If it stays, tell the service's owner, whose log says more.",
    "database-damaged": "The service's owner has to restore the data folder from a copy.",
    "not-ready": "Wait as long as Retry-After says, if it is there, and try again; /readyz says "
    "what is missing.",
    "hold-lost": "Send it again. A server that took it in was silent for so long that others took "
    "it for dead, and removed what no job named yet.",
    "disk-full": "Try again later. The service's owner has to make room, or keep results for fewer "
    "days (OCCLUDER_KEEP_DAYS).",
}
"""By slug, what to do."""

router = APIRouter(tags=["service"])


def kinds(root: type[ServiceError] = ServiceError) -> Iterator[type[ServiceError]]:
    """Every kind of problem that there is."""
    yield root
    for kind in root.__subclasses__():
        yield from kinds(kind)


@router.get(
    "/problems/{slug}",
    response_class=HTMLResponse,
    responses=refusals(404),
    summary="What a kind of problem means",
    response_description="A page for people.",
)
def problem_page(slug: str) -> HTMLResponse:
    """The page that the `type` of a problem leads to."""
    kind = next((one for one in kinds() if one.slug == slug), None)
    if kind is None:
        raise NotFoundError("there is no such kind of problem", remedy="see /docs")
    return HTMLResponse(
        "<!doctype html><html lang=en><meta charset=utf-8>"
        f"<title>{escape(kind.title)}</title>"
        f"<h1>{escape(kind.title)}</h1><p>{escape(inspect.getdoc(kind) or '')}</p>"
        f"<p>{escape(ADVICE.get(slug, ''))}</p>"
        f"<p><small>{escape(slug)}, HTTP status {kind.status}</small>"
    )


@router.get("/docs", response_class=HTMLResponse, include_in_schema=False)
async def docs() -> HTMLResponse:
    """Swagger UI.  Its script is a file of its own, as the content security policy demands."""
    return HTMLResponse(_PAGE)


@router.get("/docs/start.js", include_in_schema=False)
async def start() -> Response:
    return Response(_START, media_type="text/javascript")


def add_swagger(app: FastAPI) -> None:
    """Serve Swagger UI's own files, which come with a package."""
    folder = files("fastapi_offline") / "static"
    app.mount("/docs/swagger", StaticFiles(directory=str(folder)), name="swagger")
