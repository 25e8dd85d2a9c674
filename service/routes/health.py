"""How the service is: whether it is up, whether it can take jobs, and numbers for Prometheus."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from fastapi.responses import Response
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel, Field

from service.errors import NotReadyError
from service.routes.docs import EVERYWHERE, refusals
from service.routes.services import KEYED, Reader, TheServices

router = APIRouter(tags=["service"])


class Health(BaseModel):
    """The service answers."""

    status: Literal["ok"] = "ok"
    version: str = Field(description="Of the library.")


class Readiness(BaseModel):
    """The service can take jobs."""

    status: Literal["ready"] = "ready"
    checks: list[str] = Field(
        description="What was looked at.",
        examples=[["database", "blobs", "disk", "engine", "kernels"]],
    )


@router.get("/healthz", responses=refusals(403, 421), summary="Whether the service is up")
async def healthz(services: TheServices) -> Health:
    """Open to all. It asks nothing of the database: an answer is all that it says."""
    return Health(version=services.version)


@router.get("/readyz", responses=refusals(403, 421, 503), summary="Whether it can take jobs")
def readyz(services: TheServices) -> Readiness:
    """Open to all. 503 says in words what is wrong, or that the first start still compiles."""
    faults = {name: check() for name, check in services.checks.items()}
    said = [f"{name}: {fault}" for name, fault in faults.items() if fault]
    if said:
        raise NotReadyError(
            "; ".join(said), remedy="it may pass; if it stays, see the service's log"
        )
    return Readiness(checks=list(faults))


@router.get(
    "/metrics",
    response_class=Response,
    dependencies=KEYED,
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
