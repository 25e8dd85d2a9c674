"""The API to look at and to try, without a request to any other machine."""

from __future__ import annotations

from importlib.resources import files

from fastapi import APIRouter, FastAPI
from fastapi.responses import HTMLResponse, Response
from fastapi.staticfiles import StaticFiles

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

router = APIRouter(include_in_schema=False)


@router.get("/docs", response_class=HTMLResponse)
async def docs() -> HTMLResponse:
    """Swagger UI.  Its script is a file of its own, as the content security policy demands."""
    return HTMLResponse(_PAGE)


@router.get("/docs/start.js")
async def start() -> Response:
    return Response(_START, media_type="text/javascript")


def add_swagger(app: FastAPI) -> None:
    """Serve Swagger UI's own files, which come with a package."""
    folder = files("fastapi_offline") / "static"
    app.mount("/docs/swagger", StaticFiles(directory=str(folder)), name="swagger")
