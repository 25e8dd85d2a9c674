"""What more time buys on an asset's mesh."""

from __future__ import annotations

import math
from typing import Annotated, Any

from fastapi import APIRouter, Body, Request, Response

from service.headers import IDEMPOTENCY_KEY, idempotency_key
from service.jobs.job import JobKind
from service.routes import actions
from service.routes.docs import EVERYWHERE, refusals
from service.routes.jobs import NEW_JOB, shown
from service.routes.services import KEYED, TheServices, Writer
from service.schemas.job import Job
from service.schemas.job_options import option_tables

router = APIRouter(prefix="/v1", tags=["submit"], dependencies=KEYED)

_SCHEMA = option_tables(math.inf, math.inf)[JobKind.TRADEOFF].schema()


@router.post(
    "/assets/{asset_id}/tradeoff",
    status_code=202,
    response_description="The job.",
    responses={202: NEW_JOB, **refusals(*EVERYWHERE, 404, 409, 507)},
    openapi_extra={
        "parameters": [IDEMPOTENCY_KEY],
        "requestBody": {"content": {"application/json": {"schema": _SCHEMA}}},
    },
    summary="Measure speed against accuracy",
)
def measure_tradeoff(
    asset_id: str,
    options: Annotated[dict[str, Any], Body(description="What to measure.")],
    request: Request,
    response: Response,
    services: TheServices,
    caller: Writer,
) -> Job:
    """Many settings on the mesh of the asset's latest run, each timed and judged.

    Results are `tradeoff.html` to read, and the rows as `tradeoff.csv` and `tradeoff.json`.
    """
    job = actions.sweep(services, caller, asset_id, options, idempotency_key(request.headers))
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return shown(services, caller, job)
