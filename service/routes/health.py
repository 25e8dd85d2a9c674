"""Whether the service is up, and whether it can take jobs."""

from __future__ import annotations

from fastapi import APIRouter

from service.errors import NotReadyError
from service.routes.docs import refusals
from service.routes.services import TheServices
from service.schemas.health import Health, Readiness

router = APIRouter(tags=["service"])


@router.get("/healthz", responses=refusals(403, 421), summary="Whether the service is up")
async def healthz(services: TheServices) -> Health:
    """Open to all. It asks nothing of the database: an answer is all that it says."""
    return Health(version=services.version)


@router.get("/readyz", responses=refusals(403, 421, 503), summary="Whether it can take jobs")
def readyz(services: TheServices) -> Readiness:
    """Open to all. 503 says in words what is wrong."""
    faults = {name: check() for name, check in services.checks.items()}
    said = [f"{name}: {fault}" for name, fault in faults.items() if fault]
    if said:
        raise NotReadyError(
            "; ".join(said), remedy="it may pass; if it stays, see the service's log"
        )
    return Readiness(checks=list(faults))
