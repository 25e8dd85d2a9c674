"""Numbers for Prometheus."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST

from service.routes.docs import EVERYWHERE, refusals
from service.routes.services import KEYED, Reader, TheServices

router = APIRouter(tags=["service"], dependencies=KEYED)


@router.get(
    "/metrics",
    response_class=Response,
    responses={
        200: {
            "description": "In Prometheus' text format.",
            "content": {"text/plain": {"schema": {"type": "string"}}},
        },
        **refusals(*EVERYWHERE),
    },
    summary="Numbers for Prometheus",
)
def metrics(services: TheServices, caller: Reader) -> Response:
    """Queue, jobs and failures of all; precision and recall of your own assets."""
    # Without keys there is one owner, who sees all that there is.
    tenant = caller.tenant if services.settings.keys_needed else None
    return Response(services.metrics.text(tenant), media_type=CONTENT_TYPE_LATEST)
